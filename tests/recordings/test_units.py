"""Units of recorded columns and their conversion to SI."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.errors import RecordingError
from tautwire.recordings.units import UNITS, find_unit, require_unit

pint = pytest.importorskip("pint")
PINT_NAMES = {"kg": "kgf", "g": "gram * standard_gravity", "gf": "gram * standard_gravity"}
COLUMNS = {"time": "time", "length": "x", "speed": "winch_speed_1", "force": "tension_1"}


@pytest.mark.parametrize("quantity", UNITS)
def test_every_unit_is_what_another_library_says(quantity: str) -> None:
    base = UNITS[quantity][0]
    assert base.is_si
    registry = pint.UnitRegistry()
    for unit in UNITS[quantity]:
        name = PINT_NAMES.get(unit.symbol, unit.symbol) if quantity == "force" else unit.symbol
        assert unit.to_si(1.0) == pytest.approx(registry.Quantity(1.0, name).to(base.symbol).magnitude, rel=1e-12)


def test_decimal_multiples_are_rounded_once() -> None:
    assert find_unit("ms", "time").to_si(35.0) == 0.035  # type: ignore[union-attr]
    assert find_unit("kN", "tension_2").to_si(np.array([1.1])).tolist() == [1100.0]  # type: ignore[union-attr]


@pytest.mark.parametrize("text", ["[us]", "(µs)", " μs ", "us"])
def test_a_unit_may_stand_in_brackets_and_with_either_micro_sign(text: str) -> None:
    unit = find_unit(text, "time")
    assert unit is not None and unit.symbol == "us"


@pytest.mark.parametrize("text", ["mm/sec", "[mm/sec]", "in/sec", "m/sec"])
def test_a_second_may_be_sec(text: str) -> None:
    unit = find_unit(text, "winch_speed_1")
    assert unit is not None and unit.symbol == text.strip("[]").removesuffix("ec")


@pytest.mark.parametrize(("text", "column"), [("S", "time"), ("MN", "tension_1"), ("m", "winch_speed_1"), ("N", "x")])
def test_units_are_not_guessed(text: str, column: str) -> None:
    with pytest.raises(RecordingError, match=rf"fit\.csv: line 2, column {column}: is in '{text}', not a known unit"):
        require_unit(text, column, f"fit.csv: line 2, column {column}", 2)


@pytest.mark.parametrize(
    ("text", "column", "symbol"),
    [("(Seconds)", "time", "s"), ("[milliseconds]", "time", "ms"), ("(Millimeters)", "x", "mm"), ("(metre)", "z", "m")],
)
def test_a_unit_in_brackets_may_be_a_word(text: str, column: str, symbol: str) -> None:
    unit = find_unit(text, column)
    assert unit is not None and unit.symbol == symbol
    assert find_unit(text[1:-1], column) is None
