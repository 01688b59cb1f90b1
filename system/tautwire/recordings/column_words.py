"""What the words and the unit in the name of a column tell: its kind, its cable, and a scale that it needs."""

from __future__ import annotations

import re
from collections.abc import Iterable

from ..robot.recorded_columns import CABLE_COLUMNS
from ..robot.schema import AXES, QUATERNION_COLUMNS
from .csv_lines import unit_in_name
from .units import find_unit

# Words of laboratories for each kind of column, the most specific first; a word is a part of a name in lower case.
WORDS = (
    ("time", ("t", "ts", "time", "timestamp", "zeit", "temps", "tiempo", "tempo", "seconds")),
    ("tension", ("tension", "force", "effort", "kraft", "fuerza", "forza", "loadcell", "load", "cell", "f", "ft")),
    (
        "winch_speed",
        ("velocity", "vel", "speed", "omega", "v", "geschwindigkeit", "drehzahl", "vitesse", "velocidad", "velocita"),
    ),
    (
        "rope_length",
        ("length", "encoder", "enc", "geber", "counts", "cnt", "laenge", "länge", "angle", "winkel", "longueur"),
    ),
)
# German names join the words of rope and winch to that of the quantity.
_COMPOUND = re.compile(r"^(seil|winden|trommel|antriebs?|motor)(kraft|geschwindigkeit|drehzahl|laenge|länge|winkel)$")
# Words of what is measured at, without the quantity.
DRIVE_WORDS = ("winch", "drive", "motor", "drum", "trommel", "winde", "winden", "antrieb", "antriebs", "treuil")
ROPE_WORDS = ("rope", "seil", "cable", "câble")
# Words that a name of a coordinate may have beside x, y or z.
TRACKED_WORDS = ("rigid", "body", "tracker", "platform", "tcp", "marker")
POSITION_WORDS = ("pos", "position", *TRACKED_WORDS)
# Words of columns that no standard column is for, though they may have a word of one.
OTHER_WORDS = """
    set setpoint target desired command cmd ref soll error fault alarm status state zustand mode flag enable enabled
    torque moment drehmoment current strom voltage volt volts spannung power leistung pwm duty percent pct
    temp temperature temperatur pressure druck acc accel acceleration beschleunigung gyro mag imu rate jerk
    quat quaternion rot rotation orientation euler roll pitch yaw cycle period duration delay latency jitter
"""
# Words of a quaternion beside the letter of its part; those of the second row may also be of angles.
QUATERNION_WORDS = ("q", "quat", "quaternion")
ROTATION_WORDS = ("rot", "rotation", "orientation")
# A word that names all parts, in the order in which they are numbered.
QUATERNION_ORDERS = ("xyzw", "wxyz")
# Factors of the units that are no units of length or speed, which only the laboratory's numbers convert.
_PER_COUNT = "metres per count (2 pi * drum radius / counts per turn)"
_COUNTS = dict.fromkeys(("counts", "count", "cnt", "inc", "ticks", "pulses"), _PER_COUNT)
_FACTORS = {
    "rope_length": _COUNTS
    | {"rad": "the drum's radius"}
    | dict.fromkeys(("deg", "°"), "radius * pi / 180")
    | dict.fromkeys(("rev", "turns"), "radius * 2 * pi"),
    "winch_speed": {"rad/s": "the drum's radius", "rev/s": "radius * 2 * pi"}
    | dict.fromkeys(("deg/s", "°/s"), "radius * pi / 180")
    | dict.fromkeys(("rpm", "1/min", "u/min", "rev/min"), "radius * pi / 30"),
}
# Words without a unit that tell that a factor is needed.
FACTOR_WORDS = {
    "rope_length": (
        ("counts", "cnt", "enc", "encoder", "geber", "angle", "winkel"),
        f"{_PER_COUNT}, or the drum's radius for rad",
    ),
    "tension": (("effort",), "1 / the drum's radius where it is a torque in N m"),
    "winch_speed": (("omega", "drehzahl"), "the drum's radius for rad/s, radius * pi / 30 for rpm"),
}
NOT_NAMED = "quantity not named"
# Behind the words, in brackets or not.
_NUMBER_AT_END = re.compile(r"[\s_.]*(?:\d+|\[\d+\]|\(\d+\))$")
_PARTS = re.compile(r"[^\W\d_]+|[0-9]+")


def stated_unit(name: str) -> str:
    """The unit in a name: in brackets, or a known one behind a slash or at its end, a number aside; else blank."""
    without_number = _NUMBER_AT_END.sub("", name)
    beside = unit_in_name(without_number)
    if beside[:1] in ("[", "("):
        return beside
    *before, ending = re.split(r"[\s_.]+", without_number)
    kinds = ("time", "x", *CABLE_COLUMNS)
    candidates = [text for text in (ending if before else "", beside) if text]
    return next((text for text in candidates if any(is_unit_of(text, kind) for kind in kinds)), "")


def is_unit_of(text: str, kind: str) -> bool:
    """Whether this is a unit of a kind of column, or one that a factor converts to it."""
    return find_unit(text, f"{kind}_1" if kind in CABLE_COLUMNS else kind) is not None or bool(factor_of(text, kind))


def factor_of(unit: str, kind: str) -> str:
    """The factor that a unit needs; blank where none is known."""
    return _FACTORS.get(kind, {}).get(unit.strip("[]() ").lower(), "")


def words_of(name: str) -> list[str]:
    """Words of a name in lower case, without its unit: parted at capitals, digits and marks."""
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.removesuffix(stated_unit(name)))
    parts = [part.lower() for part in _PARTS.findall(parted)]
    compounds = [_COMPOUND.fullmatch(part) for part in parts]
    return [
        word for part, match in zip(parts, compounds, strict=True) for word in (match.groups() if match else (part,))
    ]


def kind_of(name: str) -> tuple[str | None, str]:
    """The kind of a column that the words of its name tell, and the doubt; None where they tell another quantity."""
    unit = stated_unit(name)
    every_word = words_of(name)
    words = [word for word in every_word if not word.isdigit()]
    has_number = len(words) < len(every_word)
    kinds = {kind: set(known) & set(words) for kind, known in WORDS if set(known) & set(words)}
    is_drive, is_position = has_any(words, DRIVE_WORDS), has_any(words, POSITION_WORDS)
    axes = [word for word in words if word in AXES]
    if has_any(words, OTHER_WORDS.split()) or (axes and (kinds or is_drive or len(axes) > 1)):
        return None, ""
    if axes:
        is_named = is_position or len(words) == 1 or is_unit_of(unit, axes[0])
        return (axes[0], "" if is_named else NOT_NAMED) if is_position or len(words) <= 2 else (None, "")
    # A time has no number; T with one is the symbol of tension.
    if has_number and kinds.pop("time", set()) == {"t"} and not kinds and not is_drive:
        kinds = {"tension": {"t"}}
    for kind, telling in kinds.items():
        is_symbol = kind != "time" and all(len(word) == 1 for word in telling)
        return kind, NOT_NAMED if is_symbol and not is_unit_of(unit, kind) else ""
    if is_drive and is_position:
        return "rope_length", ""
    if is_drive or has_any(words, ROPE_WORDS):
        candidates = ("winch_speed", "rope_length") if is_drive else ("rope_length", "winch_speed", "tension")
        told = [kind for kind in candidates if is_unit_of(unit, kind)]
        return (told[0], "") if told else (candidates[0], NOT_NAMED)
    by_unit = [kind for kind in ("winch_speed", "tension") if unit and has_number and is_unit_of(unit, kind)]
    return (by_unit[0], NOT_NAMED) if by_unit and len(words) <= 2 else (None, "")


def quaternion_part(name: str, first: int = 0) -> str | None:
    """The part of a quaternion that the words of a name tell, as ``qx``; None where they tell none.

    Numbers count from the ``first``; the scalar part has that one, unless a word is the order of the letters.
    """
    words = [word for word in words_of(name) if word not in POSITION_WORDS]
    told = [word for word in words if word in QUATERNION_COLUMNS]
    others = OTHER_WORDS.split()
    is_named = has_any(words, QUATERNION_WORDS)
    if is_named or has_any(words, ROTATION_WORDS):
        told += [f"q{word}" for word in words if f"q{word}" in QUATERNION_COLUMNS]
        others = [word for word in others if word not in (*QUATERNION_WORDS, *ROTATION_WORDS)]
    order = next((word for word in words if word in QUATERNION_ORDERS), None)
    letters = [f"q{letter}" for letter in order] if order else QUATERNION_COLUMNS
    numbers = [int(word) - first for word in words if word.isdigit() and 0 <= int(word) - first < len(letters)]
    # Of a robot's joints q1 is the first.
    if (order or (is_named and first == 0)) and not told and len(numbers) == 1:
        told = [letters[numbers[0]]]
    return told[0] if len(told) == 1 and not has_any(words, others) else None


def position_number(name: str) -> int | None:
    """The number of a coordinate in a name that has no other words than a tracked point's; None for any other.

    Without such a word a numbered position may be a motor's.
    """
    words = [word for word in words_of(name) if not word.isdigit()]
    is_tracked = has_any(words, TRACKED_WORDS) and set(words) <= set(POSITION_WORDS)
    return cable_number(name) if is_tracked else None


def has_any(words: Iterable[str], known: Iterable[str]) -> bool:
    """Whether one of the words is known."""
    return bool(set(words) & set(known))


def cable_number(name: str) -> int | None:
    """The number in a name; None where it has none, or several."""
    numbers = [int(word) for word in words_of(name) if word.isdigit() and len(word) < 4]
    return numbers[0] if len(numbers) == 1 else None
