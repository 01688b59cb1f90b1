"""Units of recorded columns, and their conversion to SI."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError, format_value
from ..name_suggestions import join_names
from ..robot.schema import AXES, QUATERNION_COLUMNS

STANDARD_GRAVITY = 9.80665  # m/s^2, of the kilogram-force
POUND_FORCE = 4.4482216152605  # N
INCH, FOOT = 0.0254, 0.3048  # m

Number = TypeVar("Number", float, NDArray[np.float64])


@dataclass(frozen=True)
class Unit:
    """A unit of measurement: its SI value is ``shown * factor / divisor``.

    The divisor keeps the conversion correctly rounded where the SI unit is a multiple: 35 ms are 0.035 s.
    """

    symbol: str
    factor: float = 1.0
    divisor: float = 1.0

    @property
    def is_si(self) -> bool:
        """Whether numbers stay as they are."""
        return self.factor == self.divisor == 1.0

    def to_si(self, shown: Number) -> Number:
        """Convert numbers in this unit to SI."""
        return shown * self.factor / self.divisor


_TIME = (
    Unit("s"),
    Unit("ms", divisor=1e3),
    Unit("us", divisor=1e6),
    Unit("ns", divisor=1e9),
    Unit("min", 60.0),
    Unit("h", 3600.0),
    Unit("d", 86_400.0),
)
_LENGTH = (
    Unit("m"),
    Unit("mm", divisor=1e3),
    Unit("cm", divisor=1e2),
    Unit("um", divisor=1e6),
    Unit("in", INCH),
    Unit("ft", FOOT),
)
_SPEED = (
    Unit("m/s"),
    Unit("mm/s", divisor=1e3),
    Unit("cm/s", divisor=1e2),
    Unit("m/min", divisor=60.0),
    Unit("mm/min", divisor=6e4),
    Unit("km/h", divisor=3.6),
    Unit("in/s", INCH),
    Unit("ft/s", FOOT),
)
_FORCE = (
    Unit("N"),
    Unit("kN", 1e3),
    Unit("mN", divisor=1e3),
    Unit("daN", 10.0),
    Unit("kgf", STANDARD_GRAVITY),
    Unit("kg", STANDARD_GRAVITY),
    Unit("gf", STANDARD_GRAVITY, 1e3),
    Unit("g", STANDARD_GRAVITY, 1e3),
    Unit("lbf", POUND_FORCE),
)
_RATIO = (Unit("1"),)
UNITS: Mapping[str, tuple[Unit, ...]] = {
    "time": _TIME,
    "length": _LENGTH,
    "speed": _SPEED,
    "force": _FORCE,
    "ratio": _RATIO,
}

_OTHER_SPELLINGS = {
    "sec": "s",
    "msec": "ms",
    "m*s^-1": "m/s",
    "m s^-1": "m/s",
    "m s-1": "m/s",
    "inch": "in",
    "kp": "kgf",
    "lb": "lbf",
    "-": "1",
}
# Units in words, as trackers write them behind a name; without brackets such a word may be a name.
_IN_WORDS = {
    word + plural: symbol
    for words, symbol in (
        (("second",), "s"),
        (("hour",), "h"),
        (("day",), "d"),
        (("millisecond",), "ms"),
        (("microsecond",), "us"),
        (("meter", "metre"), "m"),
        (("centimeter", "centimetre"), "cm"),
        (("millimeter", "millimetre"), "mm"),
        (("newton",), "N"),
        (("kilonewton",), "kN"),
    )
    for word in words
    for plural in ("", "s")
} | {"inches": "in", "foot": "ft", "feet": "ft"}
# Units of what is proportional to a quantity: by the factor that makes SI units of them.
_SCALED_UNITS = {
    "the drum's radius": ("rad", "rad/s"),
    "pi / 180 times the drum's radius": ("deg", "deg/s", "\u00b0", "\u00b0/s"),
    "2 pi times the drum's radius": ("rev", "rev/s", "turns", "turns/s", "rps"),
    "2 pi / 60 times the drum's radius": ("rpm", "1/min", "rev/min", "min^-1", "min-1", "u/min"),
    "2 pi times the drum's radius / counts per turn": ("counts", "count", "cnt", "inc", "ticks", "counts/s"),
}
_SCALED_FORCES = {"the load cell's N for one": ("v", "mv", "mv/v", "ma", "counts", "count", "lsb", "bit", "digits")}
_BRACKETS = re.compile(r"\[(.*)\]|\((.*)\)")
_MICRO_SIGNS = str.maketrans({"\u00b5": "u", "\u03bc": "u", "\u00b7": "*", "\u22c5": "*"})


def quantity_of(column: str) -> str:
    """Physical quantity of a known column of a recording, a key of ``UNITS``."""
    if column == "time":
        return "time"
    if column in QUATERNION_COLUMNS:
        return "ratio"
    if column in AXES or column.startswith("rope_length_"):
        return "length"
    return "speed" if column.startswith("winch_speed_") else "force"


def find_unit(text: str, column: str) -> Unit | None:
    """The unit of a known column that is written so, in brackets or not; None where it is not listed."""
    brackets = _BRACKETS.fullmatch(text.strip())
    bare = text.strip() if brackets is None else (brackets.group(1) or brackets.group(2) or "").strip()
    symbol = re.sub(r"(?<=/)sec$", "s", bare.translate(_MICRO_SIGNS))
    symbol = _OTHER_SPELLINGS.get(symbol, symbol)
    symbol = symbol if brackets is None else _IN_WORDS.get(symbol.lower(), symbol)
    return next((unit for unit in UNITS[quantity_of(column)] if unit.symbol == symbol), None)


def is_any_unit(text: str) -> bool:
    """Whether this is a known unit of any quantity that is recorded."""
    return any(find_unit(text, column) for column in ("time", "x", "winch_speed_1", "tension_1"))


def require_unit(text: str, column: str, where: str, line: int | None = None) -> Unit:
    """The unit of a known column that is written so; raises RecordingError, about ``where``, if it is not listed."""
    unit, quantity = find_unit(text, column), quantity_of(column)
    if unit is None and quantity == "ratio" and not text.strip():
        return _RATIO[0]
    if unit is None:
        problem = f"is in {format_value(text)}, not a known unit of {quantity}" if text.strip() else "has no unit"
        hint = f"write one of {', '.join(unit.symbol for unit in UNITS[quantity])}"
        scaled = _SCALED_UNITS if quantity in ("length", "speed") else _SCALED_FORCES if quantity == "force" else {}
        per_one = next((each for each, symbols in scaled.items() if text.strip(" []()").lower() in symbols), "")
        if per_one:
            hint = f"leave the unit out, and declare factor = {per_one} in [recording.columns]"
        raise RecordingError(where, problem, hint, line)
    return unit


def units_in_words(units: Mapping[str, Unit]) -> str:
    """Columns by their units that are not SI, as in ``x, y in mm; tension_1 in kN``."""
    by_symbol: dict[str, list[str]] = {}
    for name, unit in units.items():
        if not unit.is_si:
            by_symbol.setdefault(unit.symbol, []).append(name)
    return "; ".join(f"{join_names(names)} in {symbol}" for symbol, names in by_symbol.items())
