"""Units of FMU variables, as exponents of the SI base units for FMI's UnitDefinitions."""

from typing import Dict

UNITS: Dict[str, Dict[str, int]] = {
    "1": {},
    "s": {"s": 1},
    "Hz": {"s": -1},
    "rad/s": {"rad": 1, "s": -1},
    "m": {"m": 1},
    "m2": {"m": 2},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "kg": {"kg": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N/s": {"kg": 1, "m": 1, "s": -3},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "Pa s": {"kg": 1, "m": -1, "s": -1},
    "1/Pa": {"kg": -1, "m": 1, "s": 2},
    "1/(Pa s)": {"kg": -1, "m": 1, "s": 1},
    "1/N": {"kg": -1, "m": -1, "s": 2},
    "m/N": {"kg": -1, "s": 2},
    "K": {"K": 1},
    "1/K": {"K": -1},
    "K/s": {"K": 1, "s": -1},
    "rad": {"rad": 1},
    "rad/s2": {"rad": 1, "s": -2},
    "kg m2": {"kg": 1, "m": 2},
    "N m": {"kg": 1, "m": 2, "s": -2},
    "N m/s": {"kg": 1, "m": 2, "s": -3},
    "N m s": {"kg": 1, "m": 2, "s": -1},
    "kg/m": {"kg": 1, "m": -1},
    "kg/m3": {"kg": 1, "m": -3},
}
