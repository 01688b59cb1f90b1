"""A proposal of [recording.columns] for a recording, by the words and units in the names of its columns."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import one_line
from ..robot.recorded_columns import CABLE_COLUMNS, column_line
from ..robot.robot_file_reader import MAX_CABLES
from ..robot.schema import AXES, QUATERNION_COLUMNS, RecordedColumn
from .column_names import ColumnName
from .csv_lines import unit_in_name
from .recording_table import known_columns
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
POSITION_WORDS = ("pos", "position", "rigid", "body", "tracker", "platform", "tcp", "marker")
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
_FACTOR_WORDS = {
    "rope_length": (
        ("counts", "cnt", "enc", "encoder", "geber", "angle", "winkel"),
        f"{_PER_COUNT}, or the drum's radius for rad",
    ),
    "tension": (("effort",), "1 / the drum's radius where it is a torque in N m"),
    "winch_speed": (("omega", "drehzahl"), "the drum's radius for rad/s, radius * pi / 30 for rpm"),
}

# Reasons and doubts that a proposal by values may remove.
NOTHING_SAID = "no known word"
NO_UNIT = "no unit in the name: the file's, or SI"
# What stands before the factor that a column needs, and what its sign has to be.
ADD_FACTOR = "add factor = "
SIGNS = {"winch_speed": "positive has to reel in", "rope_length": "has to fall as it reels in"}
OTHER_QUANTITY = "words or a unit of other quantities"
_NOT_NAMED = "quantity not named"
_SCALAR_FIRST = "numbered from 0: the scalar part has to be the first"
_PARTS = re.compile(r"[^\W\d_]+|[0-9]+")


@dataclass(frozen=True)
class ProposedColumn:
    """One line of a proposal: the standard ``column``, the laboratory's ``name``, its ``unit``, and the ``doubt``.

    ``factor`` and ``sign`` are those that the numbers tell, None and 1 where they do not.
    """

    column: str
    name: str
    unit: str = ""
    doubt: str = ""
    factor: float | None = None
    sign: int = 1

    def line(self) -> str:
        """The line of TOML, with the doubt as a comment behind it."""
        factor = 1.0 if self.factor is None else self.factor
        line = column_line(RecordedColumn(self.column, self.name, self.unit, factor, self.sign))
        return f"{line}  # {self.doubt}" if self.doubt else line


@dataclass(frozen=True)
class ColumnProposal:
    """Proposed ``columns``, of which ``standard_names`` need no line; the reason for each ``unused`` name."""

    columns: tuple[ProposedColumn, ...]
    standard_names: frozenset[str]
    unused: Mapping[str, str]


def propose_columns(names: Sequence[ColumnName], cable_count: int) -> ColumnProposal:
    """Propose the columns of a recording of n = ``cable_count`` cables by its names, as ``column_names`` has them.

    A standard name is always used. Another is where its words tell one kind, and its numbers the cable, of a column
    without a standard name; where two are for one column neither is.
    """
    known = known_columns(cable_count)
    claims: dict[str, list[str]] = {}
    for each in names:
        if each.standard_name in known:
            claims.setdefault(str(each.standard_name), []).append(each.name)
    standard = frozenset(claims)
    words = {each.name: each.words for each in names if each.standard_name not in known}
    claimed, unused = _claims(words, cable_count)
    for column, claimants in claimed.items():
        if column in standard:
            unused |= dict.fromkeys(claimants, f"looks like {column}, which is read by its standard name")
        else:
            claims[column] = claimants
    columns = []
    for column, claimants in claims.items():
        if len(claimants) > 1:
            unused |= {name: f"one of {len(claimants)} that look like {column}" for name in claimants}
        else:
            (name,) = claimants
            is_standard = column in standard
            columns.append(ProposedColumn(column, name) if is_standard else _proposed(column, name, words[name]))
    return ColumnProposal(sorted_columns(columns), standard & {each.column for each in columns}, unused)


def likely_cable_count(names: Sequence[ColumnName]) -> int:
    """The largest number of a cable in the names of winches and load cells; 0 where none has a number."""
    columns = propose_columns(names, MAX_CABLES).columns
    numbers = [_order(each.column)[1] for each in columns if each.column.rpartition("_")[0] in CABLE_COLUMNS]
    return max(numbers, default=0)


def sorted_columns(columns: Iterable[ProposedColumn]) -> tuple[ProposedColumn, ...]:
    """The columns in the order of a table: time, those of cables by their numbers, and coordinates."""
    return tuple(sorted(columns, key=lambda each: _order(each.column)))


def _claims(words: Mapping[str, str], cable_count: int) -> tuple[dict[str, list[str]], dict[str, str]]:
    """The names that are for each column by the words of each, and the reasons for the others."""
    claims: dict[str, list[str]] = {}
    unused: dict[str, str] = {}
    numbered: dict[str, dict[str, int]] = {kind: {} for kind in CABLE_COLUMNS}
    parts = {name: part for name, text in words.items() if (part := _quaternion_part(text))}
    is_whole = set(parts.values()) == set(QUATERNION_COLUMNS)
    for name, text in words.items():
        kind, _ = _kind(text)
        unit, number = unit_in_name(text), _cable_number(text)
        if not name.strip() or not name.isprintable():
            unused[name] = "blank, or not printable"
        elif name in parts and is_whole:
            claims.setdefault(parts[name], []).append(name)
        elif kind is None:
            is_other = bool(unit) or _has_any(_words(text), (*OTHER_WORDS.split(), *AXES))
            unused[name] = OTHER_QUANTITY if is_other else NOTHING_SAID
        elif unit and unit == _stated_unit(text) and not _is_unit_of(unit, kind):
            unused[name] = f"looks like {kind}, and {unit} is not a known unit of it"
        elif kind not in numbered:
            claims.setdefault(kind, []).append(name)
        elif not cable_count:
            unused[name] = f"looks like {kind}, and a tracker's file has none"
        elif number is None:
            unused[name] = f"looks like {kind}, of no one cable"
        else:
            numbered[kind][name] = number
    for kind, numbers in numbered.items():
        # Where 0 is beside n, cables are counted from 1 and 0 is none of them.
        first = 0 if 0 in numbers.values() and cable_count not in numbers.values() else 1
        for name, number in numbers.items():
            if not 0 <= number - first < cable_count:
                unused[name] = f"looks like {kind} of cable {number - first + 1}, and there are {cable_count}"
            else:
                claims.setdefault(f"{kind}_{number - first + 1}", []).append(name)
    return claims, unused


def without_positions(proposal: ColumnProposal, tracker: Path) -> ColumnProposal:
    """The proposal for a log beside a ``tracker``'s file, which has the positions: those of the log are unused."""
    unused = {
        each.name: f"looks like {each.column}, which is read from {one_line(tracker.name)}"
        for each in proposal.columns
        if each.column in AXES
    }
    unused |= {
        name: f"is {name} of the log, beside that of {one_line(tracker.name)}: rename or remove it"
        for name in sorted(proposal.standard_names.intersection(AXES))
    }
    columns = tuple(each for each in proposal.columns if each.column not in AXES)
    return ColumnProposal(columns, proposal.standard_names.difference(AXES), {**proposal.unused, **unused})


def without_orientation(proposal: ColumnProposal) -> ColumnProposal:
    """The proposal for a point mass, of which no orientation is read but by standard names."""
    dropped = [each for each in proposal.columns if each.column in {*QUATERNION_COLUMNS} - proposal.standard_names]
    unused = {each.name: f"looks like {each.column}, and a point mass has no orientation" for each in dropped}
    kept = tuple(each for each in proposal.columns if each not in dropped)
    return ColumnProposal(kept, proposal.standard_names, {**proposal.unused, **unused})


def proposal_text(path: Path, proposal: ColumnProposal, cable_count: int) -> str:
    """The proposal as TOML that ``--columns`` reads; what it cannot tell is commented out, with the reason.

    A file of no cables is a tracker's, with the table of its own.
    """
    table = "[recording.columns]" if cable_count else "[recording.tracker.columns]"
    lines = [f"# Columns of {one_line(path.name)}, proposed by names and values: check them.", table]
    if proposal.standard_names:
        standard = sorted(proposal.standard_names, key=_order)
        lines.append(f"# read by their standard names: {', '.join(standard)}")
    lines += [each.line() for each in proposal.columns if each.column not in proposal.standard_names]
    told = {each.column for each in proposal.columns} | proposal.standard_names
    required = [f"winch_speed_{cable}" for cable in range(1, cable_count + 1)] or list(AXES)
    for column in ("time", *required):
        if not told & {column, column.replace("winch_speed", "rope_length")}:
            need = "" if column in AXES else ", and it is required"
            lines.append(f'# {column} = {{ name = "" }}  # none of the names tells it{need}')
    lines += [f"# not used: {name!a}: {reason}" for name, reason in proposal.unused.items()]
    return "\n".join(lines) + "\n"


def _order(column: str) -> tuple[int, int]:
    kinds = ("time", "winch_speed", "rope_length", "tension", *AXES, *QUATERNION_COLUMNS)
    kind, _, number = column.rpartition("_")
    return (kinds.index(kind), int(number)) if kind else (kinds.index(column), 0)


def _stated_unit(name: str) -> str:
    """The unit in a name: in brackets, or a known one behind a slash or at its end, a number aside; else blank."""
    beside = unit_in_name(name)
    if beside[:1] in ("[", "("):
        return "" if beside[1:-1].strip().isdigit() else beside
    *before, ending = re.split(r"[\s_.]+", re.sub(r"[\s_.]+\d+$", "", name))
    kinds = ("time", "x", *CABLE_COLUMNS)
    candidates = [text for text in (ending if before else "", beside) if text]
    return next((text for text in candidates if any(_is_unit_of(text, kind) for kind in kinds)), "")


def _is_unit_of(text: str, kind: str) -> bool:
    """Whether this is a unit of a kind of column, or one that a factor converts to it."""
    return find_unit(text, f"{kind}_1" if kind in CABLE_COLUMNS else kind) is not None or bool(_factor(text, kind))


def _factor(unit: str, kind: str) -> str:
    """The factor that a unit needs; blank where none is known."""
    return _FACTORS.get(kind, {}).get(unit.strip("[]() ").lower(), "")


def _words(name: str) -> list[str]:
    """Words of a name in lower case, without its unit: parted at capitals, digits and marks."""
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.removesuffix(_stated_unit(name)))
    parts = [part.lower() for part in _PARTS.findall(parted)]
    compounds = [_COMPOUND.fullmatch(part) for part in parts]
    return [
        word for part, match in zip(parts, compounds, strict=True) for word in (match.groups() if match else (part,))
    ]


def _kind(name: str) -> tuple[str | None, str]:
    """The kind of a column that the words of its name tell, and the doubt; None where they tell another quantity."""
    unit = _stated_unit(name)
    every_word = _words(name)
    words = [word for word in every_word if not word.isdigit()]
    has_number = len(words) < len(every_word)
    kinds = {kind: set(known) & set(words) for kind, known in WORDS if set(known) & set(words)}
    is_drive, is_position = _has_any(words, DRIVE_WORDS), _has_any(words, POSITION_WORDS)
    axes = [word for word in words if word in AXES]
    if _has_any(words, OTHER_WORDS.split()) or (axes and (kinds or is_drive or len(axes) > 1)):
        return None, ""
    if axes:
        is_named = is_position or len(words) == 1 or _is_unit_of(unit, axes[0])
        return (axes[0], "" if is_named else _NOT_NAMED) if is_position or len(words) <= 2 else (None, "")
    # A time has no number; T with one is the symbol of tension.
    if has_number and kinds.pop("time", set()) == {"t"} and not kinds and not is_drive:
        kinds = {"tension": {"t"}}
    for kind, telling in kinds.items():
        is_symbol = kind != "time" and all(len(word) == 1 for word in telling)
        return kind, _NOT_NAMED if is_symbol and not _is_unit_of(unit, kind) else ""
    if is_drive and is_position:
        return "rope_length", ""
    if is_drive or _has_any(words, ROPE_WORDS):
        candidates = ("winch_speed", "rope_length") if is_drive else ("rope_length", "winch_speed", "tension")
        told = [kind for kind in candidates if _is_unit_of(unit, kind)]
        return (told[0], "") if told else (candidates[0], _NOT_NAMED)
    return None, ""


def _quaternion_part(name: str) -> str | None:
    """The part of a quaternion that the words of a name tell, as ``qx``; None where they tell none."""
    words = [word for word in _words(name) if word not in POSITION_WORDS]
    told = [word for word in words if word in QUATERNION_COLUMNS]
    others = OTHER_WORDS.split()
    is_named = _has_any(words, QUATERNION_WORDS)
    if is_named or _has_any(words, ROTATION_WORDS):
        told += [f"q{word}" for word in words if f"q{word}" in QUATERNION_COLUMNS]
        others = [word for word in others if word not in (*QUATERNION_WORDS, *ROTATION_WORDS)]
    numbers = [int(word) for word in words if word.isdigit() and int(word) < len(QUATERNION_COLUMNS)]
    if is_named and not told and len(numbers) == 1:
        told = [QUATERNION_COLUMNS[numbers[0]]]
    return told[0] if len(told) == 1 and not _has_any(words, others) else None


def _has_any(words: Iterable[str], known: Iterable[str]) -> bool:
    return bool(set(words) & set(known))


def _cable_number(name: str) -> int | None:
    """The number in a name; None where it has none, or several."""
    numbers = [int(word) for word in _words(name) if word.isdigit() and len(word) < 4]
    return numbers[0] if len(numbers) == 1 else None


def _proposed(column: str, name: str, words: str) -> ProposedColumn:
    """The column with the unit that its words have, and a remark where quantity, scale or sign is not certain."""
    kind = column.rpartition("_")[0] or column
    stated, (_, doubt) = _stated_unit(words), _kind(words)
    unit, factor = find_unit(stated, column), _factor(stated, kind)
    known, factor_without_unit = _FACTOR_WORDS.get(kind, ((), ""))
    if column in QUATERNION_COLUMNS:
        is_lettered = any(column in (word, f"q{word}") for word in _words(words))
        return ProposedColumn(column, name, "", "" if is_lettered else _SCALAR_FIRST)
    if unit is not None:
        scale = "" if unit_in_name(words).endswith(stated) else "unit by the name's end"
    elif factor or (not stated and _has_any(_words(words), known)):
        scale = f"{ADD_FACTOR}{factor or factor_without_unit}"
    else:
        scale = f"ends in {stated}, no unit of it" if stated else NO_UNIT
    remark = "; ".join(part for part in (scale, doubt, SIGNS.get(kind, "")) if part)
    return ProposedColumn(column, name, unit.symbol if unit else "", remark)
