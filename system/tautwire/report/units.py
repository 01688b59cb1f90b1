"""Numbers as an engineer reads them: a few significant digits, and units of a handy size."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

ABSENT = "-"
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
# Units that engineers scale, and by which prefixes; any other unit is shown as it is.
SCALED = {"Pa": "GMk", "N": "kMm", "m": "mµ", "s": "mµ", "Hz": "kM", "W": "kM", "J": "kM"}
SMALL_AREA = 1e-2  # m^2, below it an area is shown in mm^2
# As in "m^2", and in "m2" as FMI writes it.
POWER = re.compile(r"(?<=[A-Za-z])\^?([23])(?!\d)")
POWERS = {"2": "²", "3": "³"}
PLAIN_FROM, PLAIN_TO = 1e-4, 1e6
WHOLE_DIGITS = 4


def significant(value: float | None, digits: int = 3) -> str:
    """A number to so many significant digits, to four where these are whole; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return ABSENT
    if value == 0.0:
        return "0"
    size = abs(value)
    if not PLAIN_FROM <= size < PLAIN_TO:
        return f"{value:.{digits - 1}e}"
    rounded = float(f"{value:.{max(digits, WHOLE_DIGITS) - 1}e}")
    return f"{rounded:.{_decimals(size, digits)}f}"


def handy_unit(value: float, unit: str) -> tuple[str, float]:
    """The unit that suits a value given in an SI ``unit``, and how many SI units one of it is."""
    size = abs(value)
    if unit == "m^2" and 0.0 < size < SMALL_AREA:
        return "mm²", 1e-6
    # Of a compound unit such as "Pa s" or "m/s", the first factor takes the prefix.
    first = re.split("[ /^]", unit, maxsplit=1)[0]
    letters = "" if unit.startswith(f"{first}^") else SCALED.get(first, "")
    fitting = [(factor, letter) for factor, letter in PREFIXES if letter == "" or letter in letters]
    reached = [each for each in fitting if size >= each[0] * (1.0 - 1e-9)]
    factor, letter = (reached or fitting[-1:])[0] if size > 0.0 else (1.0, "")
    return _typeset(letter + unit), factor


def engineering(value: float | None, unit: str, digits: int = 3) -> str:
    """A value in an SI unit with a unit of a handy size, as in "102 GPa"."""
    if value is None or not math.isfinite(value):
        return ABSENT
    name, factor = handy_unit(value, unit)
    return f"{significant(value / factor, digits)} {name}".rstrip()


def together(values: Sequence[float | None], unit: str, width: float) -> tuple[list[str], str]:
    """Values in one handy unit with as many decimals as a ``width`` (an interval's) justifies; and that unit."""
    known = [abs(value) for value in values if value is not None and math.isfinite(value)]
    name, factor = handy_unit(known[0] if known else 0.0, unit)
    scaled = [None if value is None else value / factor for value in values]
    spread = abs(width) / factor
    largest = max((size / factor for size in known), default=0.0)
    if not 0.0 < spread < math.inf or not PLAIN_FROM <= largest < PLAIN_TO:
        return [significant(value, 4) for value in scaled], name
    decimals = min(_decimals(spread, 2), 8)
    return [_fixed(value, decimals) for value in scaled], name


def percent(share: float | None) -> str:
    """A share as per cent; close to all of it is said so, not rounded up."""
    if share is None or not math.isfinite(share):
        return ABSENT
    if 0.9995 <= share < 1.0:
        return "> 99.9 %"
    return f"{100.0 * share:.{0 if abs(share) >= 10.0 or share == 1.0 else 1}f} %"


def _fixed(value: float | None, decimals: int) -> str:
    return ABSENT if value is None or not math.isfinite(value) else f"{value:.{decimals}f}"


def _decimals(size: float, digits: int) -> int:
    """How many decimals show so many significant digits of a number of this size."""
    rounded = float(f"{size:.{digits - 1}e}")
    return max(0, digits - 1 - math.floor(math.log10(rounded)))


def _typeset(unit: str) -> str:
    """A unit as it is printed: powers raised, and nothing where a number has no unit."""
    return "" if unit == "1" else POWER.sub(lambda found: POWERS[found[1]], unit)
