"""Formatting of numbers as engineers read them: a few significant digits, and units with a fitting SI prefix."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

ABSENT_TEXT = "-"
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
# Prefixes in use for each unit; any other unit is printed as it is.
PREFIXES_BY_UNIT = {"Pa": "GMk", "N": "kMm", "m": "mµ", "s": "mµ", "Hz": "kM", "W": "kM", "J": "kM"}
MAX_AREA_IN_MM2 = 1e-2  # m^2; a smaller area is printed in mm^2
# The power in "m^2", or in "m2" as FMI writes it.
UNIT_POWER_PATTERN = re.compile(r"(?<=[A-Za-z])\^?([23])(?!\d)")
SUPERSCRIPTS = {"2": "²", "3": "³"}
MIN_PLAIN_NUMBER, MAX_PLAIN_NUMBER = 1e-4, 1e6
INTEGER_DIGITS = 4
# Units of pages whatever the size, as on workshop drawings, and their size in SI units.
PAGE_UNITS = {"m": ("mm", 1e-3), "rad": ("mrad", 1e-3)}
MAX_DIGITS = 8


def format_significant(value: float | None, digits: int = 3) -> str:
    """Formats a number to so many significant digits, integers to four; a dash for None or a non-finite number."""
    if value is None or not math.isfinite(value):
        return ABSENT_TEXT
    if value == 0.0:
        return "0"
    size = abs(value)
    if not MIN_PLAIN_NUMBER <= size < MAX_PLAIN_NUMBER:
        return f"{value:.{digits - 1}e}"
    rounded = float(f"{value:.{max(digits, INTEGER_DIGITS) - 1}e}")
    return f"{rounded:.{_decimal_places(size, digits)}f}"


def choose_unit(value: float, unit: str) -> tuple[str, float]:
    """Chooses the SI prefix for a value in an SI ``unit``; returns the prefixed unit and its size in SI units."""
    size = abs(value)
    if unit == "m^2" and 0.0 < size < MAX_AREA_IN_MM2:
        return "mm²", 1e-6
    # Of a compound unit such as "Pa s" or "m/s", the first factor takes the prefix.
    first = re.split("[ /^]", unit, maxsplit=1)[0]
    letters = "" if unit.startswith(f"{first}^") else PREFIXES_BY_UNIT.get(first, "")
    allowed_prefixes = [(factor, letter) for factor, letter in PREFIXES if letter == "" or letter in letters]
    prefixes_below_value = [each for each in allowed_prefixes if size >= each[0] * (1.0 - 1e-9)]
    factor, letter = (prefixes_below_value or allowed_prefixes[-1:])[0] if size > 0.0 else (1.0, "")
    return _typeset_unit(letter + unit), factor


def page_unit(unit: str) -> tuple[str, float]:
    """Unit in which pages state a quantity of an SI ``unit``, mm for m and mrad for rad; and its size in SI units."""
    return PAGE_UNITS.get(unit, (unit, 1.0))


def format_on_page(value: float | None, unit: str, digits: int = 3) -> str:
    """Formats a value in an SI unit as pages state it: lengths in mm, angles in mrad, others with a fitting prefix."""
    if unit not in PAGE_UNITS or value is None or not math.isfinite(value):
        return format_engineering(value, unit, digits)
    name, size = page_unit(unit)
    return f"{format_significant(value / size, digits)} {name}"


def digits_for_range(low: float, high: float) -> int:
    """Number of significant digits that show the values of a range ``low`` to ``high`` to four digits of its width."""
    size, width = max(abs(low), abs(high)), high - low
    if not 0.0 < width < math.inf:
        return INTEGER_DIGITS
    return min(MAX_DIGITS, INTEGER_DIGITS + max(0, math.ceil(math.log10(size / width))))


def digits_beside(value: float, reference: float | None) -> int:
    """Number of significant digits that show three of a value's difference from a ``reference``, if there is one."""
    if reference is None or value == reference or not math.isfinite(value) or value == 0.0:
        return 3
    places = math.floor(math.log10(abs(value))) - math.floor(math.log10(abs(value - reference)))
    return min(MAX_DIGITS, 3 + max(0, places))


def format_engineering(value: float | None, unit: str, digits: int = 3) -> str:
    """Formats a value in an SI unit with a fitting prefix, as in "102 GPa"."""
    if value is None or not math.isfinite(value):
        return ABSENT_TEXT
    name, factor = choose_unit(value, unit)
    return f"{format_significant(value / factor, digits)} {name}".rstrip()


def format_in_common_unit(values: Sequence[float | None], unit: str, width: float) -> tuple[list[str], str]:
    """Formats values in one prefixed unit with as many decimals as an interval's ``width`` justifies; and that unit."""
    magnitudes = [abs(value) for value in values if value is not None and math.isfinite(value)]
    name, factor = choose_unit(magnitudes[0] if magnitudes else 0.0, unit)
    scaled = [None if value is None else value / factor for value in values]
    spread = abs(width) / factor
    max_magnitude = max((size / factor for size in magnitudes), default=0.0)
    if not 0.0 < spread < math.inf or not MIN_PLAIN_NUMBER <= max_magnitude < MAX_PLAIN_NUMBER:
        return [format_significant(value, 4) for value in scaled], name
    decimals = min(_decimal_places(spread, 2), 8)
    return [_format_fixed(value, decimals) for value in scaled], name


def format_percent(share: float | None) -> str:
    """Formats a share as per cent; just below 1 it is "> 99.9 %", not rounded up."""
    if share is None or not math.isfinite(share):
        return ABSENT_TEXT
    if 0.9995 <= share < 1.0:
        return "> 99.9 %"
    return f"{100.0 * share:.{0 if abs(share) >= 10.0 or share == 1.0 else 1}f} %"


def _format_fixed(value: float | None, decimals: int) -> str:
    return ABSENT_TEXT if value is None or not math.isfinite(value) else f"{value:.{decimals}f}"


def _decimal_places(size: float, digits: int) -> int:
    """Number of decimals that show so many significant digits of a number of this size."""
    rounded = float(f"{size:.{digits - 1}e}")
    return max(0, digits - 1 - math.floor(math.log10(rounded)))


def _typeset_unit(unit: str) -> str:
    """A unit as printed: powers as superscripts, and empty for a dimensionless number."""
    return "" if unit == "1" else UNIT_POWER_PATTERN.sub(lambda match: SUPERSCRIPTS[match[1]], unit)
