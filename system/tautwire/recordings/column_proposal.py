"""A proposal of [recording.columns] for a recording, by the words and units in the names of its columns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import one_line
from ..robot.recorded_columns import CABLE_COLUMNS, column_line
from ..robot.robot_file_reader import MAX_CABLES
from ..robot.schema import AXES, QUATERNION_COLUMNS, RecordedColumn
from .column_names import ColumnName
from .column_words import (
    FACTOR_WORDS,
    OTHER_WORDS,
    QUATERNION_ORDERS,
    cable_number,
    factor_of,
    has_any,
    is_unit_of,
    kind_of,
    position_number,
    quaternion_part,
    stated_unit,
    words_of,
)
from .csv_lines import unit_in_name
from .recording_table import known_columns
from .units import find_unit

# Reasons and doubts that a proposal by values may remove.
NOTHING_SAID = "no known word"
NO_UNIT = "no unit in the name: the file's, or SI"
# What stands before the factor that a column needs, and what its sign has to be.
ADD_FACTOR = "add factor = "
SIGNS = {"winch_speed": "positive has to reel in", "rope_length": "has to fall as it reels in"}
OTHER_QUANTITY = "words or a unit of other quantities"
_SCALAR_FIRST = "numbered from 0: the scalar part has to be the first"


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
    parts = _quaternion_parts(words) | _coordinates(words)
    for name, text in words.items():
        kind, _ = kind_of(text)
        unit, number = unit_in_name(text), cable_number(text)
        if not name.strip() or not name.isprintable():
            unused[name] = "blank, or not printable"
        elif name in parts:
            claims.setdefault(parts[name], []).append(name)
        elif kind is None:
            is_other = bool(unit) or has_any(words_of(text), (*OTHER_WORDS.split(), *AXES))
            unused[name] = OTHER_QUANTITY if is_other else NOTHING_SAID
        elif unit and unit == stated_unit(text) and not is_unit_of(unit, kind):
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


def _quaternion_parts(words: Mapping[str, str]) -> dict[str, str]:
    """The part of a quaternion that each name is for, where all parts are there."""
    for first in (0, 1):
        parts = {name: part for name, text in words.items() if (part := quaternion_part(text, first))}
        if set(parts.values()) == set(QUATERNION_COLUMNS):
            return parts
    return {}


def _coordinates(words: Mapping[str, str]) -> dict[str, str]:
    """The coordinate that each name is for, where those of a tracked point are numbered."""
    numbers = {name: number for name, text in words.items() if (number := position_number(text)) is not None}
    first = min(numbers.values(), default=0)
    is_whole = first in (0, 1) and sorted(numbers.values()) == [first, first + 1, first + 2]
    return {name: AXES[number - first] for name, number in numbers.items()} if is_whole else {}


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


def _proposed(column: str, name: str, words: str) -> ProposedColumn:
    """The column with the unit that its words have, and a remark where quantity, scale or sign is not certain."""
    kind = column.rpartition("_")[0] or column
    stated, (_, doubt) = stated_unit(words), kind_of(words)
    unit, factor = find_unit(stated, column), factor_of(stated, kind)
    known, factor_without_unit = FACTOR_WORDS.get(kind, ((), ""))
    if column in QUATERNION_COLUMNS:
        is_lettered = any(column in (word, f"q{word}") or word in QUATERNION_ORDERS for word in words_of(words))
        return ProposedColumn(column, name, "", "" if is_lettered else _SCALAR_FIRST)
    if unit is not None:
        scale = "" if unit_in_name(words).endswith(stated) else "unit by the name's end"
    elif factor or (not stated and has_any(words_of(words), known)):
        scale = f"{ADD_FACTOR}{factor or factor_without_unit}"
    else:
        scale = f"ends in {stated}, no unit of it" if stated else NO_UNIT
    remark = "; ".join(part for part in (scale, doubt, SIGNS.get(kind, "")) if part)
    return ProposedColumn(column, name, unit.symbol if unit else "", remark)
