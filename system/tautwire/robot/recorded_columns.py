"""Columns of recordings and of a tracker's files by the laboratory's names, as the table [recording] declares them."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from ..errors import format_value
from ..name_suggestions import suggest_name
from ..validation import NumberRule
from .checked_table import CheckedTable
from .schema import AXES, QUATERNION_COLUMNS, RecordedColumn, Tracker

CABLE_COLUMNS = ("winch_speed", "rope_length", "tension")
POSE_COLUMNS = (*AXES, *QUATERNION_COLUMNS)
LOG_TABLE, TRACKER_TABLE = "recording.columns", "recording.tracker.columns"
COLUMN_NUMBERS = {
    "factor": NumberRule("the factor by which the column is multiplied", "", default=1.0),
    "sign": NumberRule("the sign of the column, 1 or -1", "", -1.0, 1.0, default=1.0),
    "offset": NumberRule("what the column shows at zero, as recorded", "", default=0.0),
}

CLOCK_OFFSET_RULE = NumberRule("what the tracker's clock shows at the first sample of the winches' log", "s")
CLOCK_RATE_RULE = NumberRule("how many times as fast the tracker's clock runs", "", 0.9, 1.1, default=1.0)

_EVERY_CABLE = "{}"
_NUMBERED = re.compile(rf"({'|'.join(CABLE_COLUMNS)})_([0-9]{{1,6}})")
_NAME_HINT = 'give the column as the recording names it, as in name = "Drive1.Velocity"'


def read_recorded_columns(root: CheckedTable, cable_count: int) -> tuple[RecordedColumn, ...]:
    """Reads the table [recording.columns] of a file; none where it has no such table."""
    recording = root.table("recording")
    if recording is None:
        return ()
    recording.require_known(("columns", "tracker"))
    return _read_columns(recording, cable_count)


def read_tracker_table(root: CheckedTable) -> Tracker:
    """Reads the table [recording.tracker] of a file; a tracker with standard columns where it has no such table."""
    is_table = isinstance(root.content.get("recording"), dict)
    recording = root.table("recording") if is_table else None
    table = None if recording is None else recording.table("tracker")
    if table is None:
        return Tracker()
    table.require_known(("columns", "clock_offset", "clock_rate"))
    offset = table.optional_number("clock_offset", CLOCK_OFFSET_RULE)
    rate = table.number("clock_rate", CLOCK_RATE_RULE)
    if offset is None and "clock_rate" in table.content:
        table.refuse("clock_rate", "is stated without clock_offset", "state both, or leave both to the winch travel")
    return Tracker(_read_columns(table, 0), offset, rate)


def _read_columns(parent: CheckedTable, cable_count: int) -> tuple[RecordedColumn, ...]:
    """The columns that the table ``columns`` of another declares; of no cables those of a tracker."""
    table = parent.table("columns")
    if table is None:
        return ()
    columns = tuple(_read_column(table, key) for key in table.content if _is_column(table, key, cable_count))
    declared = tuple(column for column in columns if column is not None)
    _require_distinct_names(table, declared, cable_count)
    return declared


def columns_of_cables(columns: Sequence[RecordedColumn], cable_count: int) -> dict[str, RecordedColumn]:
    """The declared columns by their standard names, ``{}`` replaced by the number of each cable.

    What is declared for one cable comes before what is for all.
    """
    by_name: dict[str, RecordedColumn] = {}
    for column in sorted(columns, key=lambda column: _EVERY_CABLE in column.column):
        numbers = range(1, cable_count + 1) if _EVERY_CABLE in column.column else (0,)
        for number in numbers:
            by_name.setdefault(column.column.replace(_EVERY_CABLE, str(number)), column)
    return by_name


def recorded_name(standard_name: str, column: RecordedColumn) -> str:
    """The laboratory's name of a standard column that a declaration is for."""
    if _EVERY_CABLE not in column.column:
        return column.name
    return column.name.replace(_EVERY_CABLE, standard_name.rpartition("_")[2])


def column_line(column: RecordedColumn) -> str:
    """The line of TOML that declares a column; what is as by default is left out."""
    scale = {"factor": column.factor, "sign": column.sign, "offset": column.offset}
    changed = {key: value for key, value in scale.items() if value != COLUMN_NUMBERS[key].default}
    entries = [f'unit = "{column.unit}"'] if column.unit else []
    entries += [f"{key} = {repr(value).removesuffix('.0')}" for key, value in changed.items()]
    if column.name != column.column or not entries:
        entries.insert(0, f"name = {json.dumps(column.name, ensure_ascii=False)}")
    key = f'"{column.column}"' if _EVERY_CABLE in column.column else column.column
    return f"{key} = {{ {', '.join(entries)} }}"


def _is_column(table: CheckedTable, key: str, cable_count: int) -> bool:
    """Whether a key is the name of a standard column, or of those of all cables; refuses it otherwise."""
    match = _NUMBERED.fullmatch(key)
    for_all = tuple(f"{kind}_{_EVERY_CABLE}" for kind in CABLE_COLUMNS if cable_count)
    if key in ("time", *POSE_COLUMNS, *for_all):
        return True
    if match is None or match.group(2).startswith("0"):
        numbers = [digits for digits in re.findall("[0-9]+", key) if 0 < int(digits[:6]) <= cable_count]
        numbered = [f"{kind}_{int(digits)}" for kind in CABLE_COLUMNS for digits in numbers]
        names = ("time", *POSE_COLUMNS, *for_all, *numbered)
        table.refuse(key, "is not a column of a recording", f"write {suggest_name(key, names)}")
        return False
    if cable_count == 0:
        table.refuse(key, "is not a column of a tracker", "move it to [recording.columns]")
        return False
    if int(match.group(2)) > cable_count:
        problem = f"belongs to no cable, the robot has cables 1 to {cable_count}"
        table.refuse(key, problem, "remove it, or use the robot file that belongs to it")
        return False
    return True


def _read_column(table: CheckedTable, key: str) -> RecordedColumn | None:
    value = table.content[key]
    if isinstance(value, str):
        content = CheckedTable(table.file, table.key, {"name": value}, table.sink, table.key_path)
        name = _read_name(content, key, where=(table, key))
        return None if name is None else RecordedColumn(key, name, file=table.file, table=table.key)
    if not isinstance(value, dict):
        problem = f"is {format_value(value)}, neither a name nor a table"
        table.refuse(key, problem, 'write it as in x = "Body X", or x = { name = "Body X", unit = "mm" }')
        return None
    entry = table.table(key)
    if entry is None:
        return None
    entry.require_known(("name", "unit", *COLUMN_NUMBERS))
    name = _read_name(entry, key, where=(entry, "name"))
    numbers = {each: entry.number(each, rule) for each, rule in COLUMN_NUMBERS.items()}
    if numbers["factor"] == 0.0:
        entry.refuse("factor", "is 0, must not be 0", "give SI units for each recorded unit, negative where it falls")
    if abs(numbers["sign"]) < 1.0:
        entry.refuse("sign", f"is {numbers['sign']:g}, must be 1 or -1", "write scales as factor")
    unit = entry.text("unit", 'write it as in unit = "mm"') if "unit" in entry.content else ""
    return None if name is None else RecordedColumn(key, name, unit or "", **numbers, file=table.file, table=table.key)


def _read_name(entry: CheckedTable, key: str, where: tuple[CheckedTable, str]) -> str | None:
    """The laboratory's name, by default the standard one; None where it is refused."""
    name = entry.text("name", _NAME_HINT) if "name" in entry.content else key
    if name is None:
        return None
    table, shown_key = where
    if not name.strip() or not name.isprintable():
        table.refuse(shown_key, f"is {format_value(name)}, must be one line of printable text", _NAME_HINT)
        return None
    if _EVERY_CABLE in key and _EVERY_CABLE not in name:
        hint = f"write {{}} where the cable's number stands, or one entry for each cable, as {key.format(1)}"
        table.refuse(shown_key, f"is {format_value(name)} for every cable, without {{}}", hint)
        return None
    return name


def _require_distinct_names(table: CheckedTable, columns: Sequence[RecordedColumn], cable_count: int) -> None:
    """Refuses a recorded column that is declared for two standard columns."""
    first_use: dict[str, str] = {}
    refused: set[str] = set()
    for standard_name, column in columns_of_cables(columns, cable_count).items():
        name = recorded_name(standard_name, column)
        other = first_use.setdefault(name, standard_name)
        if other != standard_name and column.column not in refused:
            refused.add(column.column)
            problem = f"is {format_value(name)}, and so is {other}"
            table.refuse(column.column, problem, "give each column a name of its own")
