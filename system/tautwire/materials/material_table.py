"""Reads the table of a dynamic test on a rope: quantities at each frequency, with their uncertainties."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from functools import partial
from io import StringIO
from itertools import islice
from pathlib import Path

from ..errors import MaterialTableError, format_value
from ..input_files import read_text_bytes, readable_file
from ..name_suggestions import suggest_name
from ..recordings.recording_table import MISSING_CELLS
from ..validation import NumberRule

PAPER_TABLE = Path(__file__).parent / "steel_wire_rope_baklouti_2017.csv"
# The row, in Hz, whose pair the paper takes as constant (sec. 4.3).
PAPER_PAIR_FREQUENCY = 2.0
MIN_ROWS, MAX_ROWS = 4, 500
MAX_FILE_BYTES = 10_000_000
MAX_DECIMAL_EXPONENT = 300
# Comment lines, and characters of a header, that are read to tell a table from a recording.
MAX_COMMENT_LINES, MAX_HEADER_LENGTH = 100, 10_000

COLUMN_RULES: Mapping[str, NumberRule] = {
    "frequency": NumberRule("the loading frequency, 0 for a static test,", "Hz", 0.0, 1e6),
    "stress_amplitude": NumberRule("the amplitude of the stress", "Pa", 0.0, 1e12, positive=True),
    "strain_amplitude": NumberRule("the amplitude of the strain", "1", 0.0, 1.0, positive=True),
    "dynamic_modulus": NumberRule("the dynamic modulus |E*|", "Pa", 1e5, 1e14),
    "storage_modulus": NumberRule("the storage modulus E'", "Pa", 1e5, 1e14),
    "loss_modulus": NumberRule("the loss modulus E''", "Pa", 0.0, 1e14),
    "phase": NumberRule("the phase by which strain lags stress", "rad", 0.0, math.pi / 2.0),
    "phase_degrees": NumberRule("the phase by which strain lags stress", "degrees", 0.0, 90.0),
    "loss_factor": NumberRule("the loss factor E''/E'", "1", 0.0, 1e3),
    "damping": NumberRule("the damping c = E''/(2 pi f)", "Pa s"),
}
UNCERTAINTY_SUFFIX = "_uncertainty"
COLUMNS_WITHOUT_UNCERTAINTY = ("frequency",)
# Two quantities that determine the complex modulus, in order of preference: what the test measures comes first.
MODULUS_PAIRS: tuple[tuple[str, str], ...] = (
    ("dynamic_modulus", "phase"),
    ("storage_modulus", "loss_factor"),
    ("storage_modulus", "loss_modulus"),
    ("storage_modulus", "damping"),
)


@dataclass(frozen=True)
class Quantity:
    """A measured number in SI units; ``resolution`` is one unit of its last digit, ``uncertainty`` one sigma."""

    value: float
    resolution: float
    uncertainty: float | None = None
    uncertainty_resolution: float = 0.0

    def scaled(self, factor: float) -> Quantity:
        """The quantity in another unit, multiplied by ``factor``."""
        sigma = None if self.uncertainty is None else self.uncertainty * factor
        return Quantity(self.value * factor, self.resolution * factor, sigma, self.uncertainty_resolution * factor)


@dataclass(frozen=True)
class MaterialRow:
    """One frequency of the test, in Hz; ``quantities`` by column, the phase in rad."""

    where: str
    frequency: float
    quantities: Mapping[str, Quantity]


@dataclass(frozen=True)
class MaterialTable:
    """A dynamic test: ``rows`` at frequencies above zero, ``static_rows`` at zero, both in the file's order."""

    path: str
    rows: tuple[MaterialRow, ...]
    static_rows: tuple[MaterialRow, ...]

    def modulus_pairs(self) -> tuple[tuple[str, str], ...]:
        """The pairs of columns that give a complex modulus with uncertainty in every row, the preferred first."""
        return tuple(
            pair for pair in MODULUS_PAIRS if all(_has_uncertainty(row, name) for row in self.rows for name in pair)
        )


def read_material_table(path: str | Path) -> MaterialTable:
    """Read the table of a dynamic test from a CSV file; raises MaterialTableError.

    Lines that begin with ``#`` are comments. Columns are those of ``COLUMN_RULES``, each with ``_uncertainty`` (one
    standard deviation) beside it where there is one; ``frequency`` and one of ``MODULUS_PAIRS`` with uncertainties are
    needed. Values in Hz, Pa, Pa s and rad, or degrees in ``phase_degrees``. A row of frequency 0 gives the storage
    modulus alone.
    """
    file = str(path)
    content = read_text_bytes(path, MaterialTableError, "CSV", MAX_FILE_BYTES)
    lines = list(_csv_rows(content.decode("utf-8-sig"), file))
    if not lines:
        raise MaterialTableError(file, "is empty", "write a header line and four or more rows")
    (where, names), body = lines[0], lines[1:]
    _require_header(names, where)
    rows = tuple(_parse_row(row_location, cells, names) for row_location, cells in body)
    table = MaterialTable(
        path=file,
        rows=tuple(row for row in rows if row.frequency > 0.0),
        static_rows=tuple(row for row in rows if row.frequency == 0.0),
    )
    _require_rows(table)
    return table


def is_material_table(path: str | Path) -> bool:
    """Whether the first line of a file that is no comment names a column "frequency" and none "time"."""
    try:
        with readable_file(path, MaterialTableError) as file_path, file_path.open("rb") as file:
            head = islice(iter(partial(file.readline, MAX_HEADER_LENGTH), b""), MAX_COMMENT_LINES)
            lines = (line.decode("utf-8-sig", "replace").strip() for line in head)
            header = next((line for line in lines if line and not line.startswith("#")), "")
    except MaterialTableError:
        return False
    names = {name.strip() for name in header.split(",")}
    return "frequency" in names and "time" not in names


def _has_uncertainty(row: MaterialRow, name: str) -> bool:
    quantity = row.quantities.get(name)
    return quantity is not None and quantity.uncertainty is not None


def _csv_rows(text: str, file: str) -> Iterator[tuple[str, list[str]]]:
    """Lines that are neither empty nor comments, as cells, each with its location."""
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip() and not line.lstrip().startswith("#"):
            where = f"{file}: line {number}"
            try:
                yield where, [cell.strip() for cell in next(csv.reader(StringIO(line)))]
            except csv.Error as problem:
                raise MaterialTableError(
                    where, f"is not valid CSV ({problem})", "write one number per cell"
                ) from problem


def _require_header(names: Sequence[str], where: str) -> None:
    known = [
        *COLUMN_RULES,
        *(name + UNCERTAINTY_SUFFIX for name in COLUMN_RULES if name not in COLUMNS_WITHOUT_UNCERTAINTY),
    ]
    for index, name in enumerate(names):
        if name in names[:index]:
            raise MaterialTableError(where, f"the column {format_value(name)} appears twice", "keep one of the two")
        if ";" in name or "\t" in name:
            problem = "the columns are separated with semicolons or tabs"
            raise MaterialTableError(
                where, problem, "separate them with commas, and write numbers with a decimal point"
            )
        if name not in known:
            hint = f"write {suggest_name(name, known)}, or remove it"
            raise MaterialTableError(where, f"the column {format_value(name)} is not known", hint)
        column = name.removesuffix(UNCERTAINTY_SUFFIX)
        if column not in names:
            raise MaterialTableError(where, f"{name} stands without {column}", f"add the column {column}")
    if "phase" in names and "phase_degrees" in names:
        raise MaterialTableError(where, "the phase is given in rad and in degrees", "keep one of the two")
    if "frequency" not in names:
        raise MaterialTableError(where, "the column frequency is missing", "add it, in Hz")


def _parse_row(where: str, cells: Sequence[str], names: Sequence[str]) -> MaterialRow:
    if len(cells) != len(names):
        hint = "complete the line, leave a cell empty where nothing was measured"
        raise MaterialTableError(where, f"has {len(cells)} cells, the header has {len(names)}", hint)
    numbers = {name: _parse_number(where, name, cell) for name, cell in zip(names, cells, strict=True)}
    if numbers["frequency"] is None:
        raise MaterialTableError(f"{where}: frequency", "is missing", COLUMN_RULES["frequency"].hint())
    quantities = {}
    for name in names:
        number, sigma = numbers[name], numbers.get(name + UNCERTAINTY_SUFFIX)
        if name in COLUMN_RULES and number is not None:
            quantities[name] = Quantity(number[0], number[1], *(sigma or ()))
    if "phase_degrees" in quantities:
        quantities["phase"] = quantities.pop("phase_degrees").scaled(math.pi / 180.0)
    frequency = quantities.pop("frequency").value
    return MaterialRow(where, frequency, quantities)


def _parse_number(where: str, name: str, cell: str) -> tuple[float, float] | None:
    """A number and one unit of its last digit; None where the cell is empty."""
    if cell in MISSING_CELLS:
        return None
    cell_location, rule = f"{where}: {name}", COLUMN_RULES[name.removesuffix(UNCERTAINTY_SUFFIX)]
    try:
        number = Decimal(cell) if cell.isascii() and "_" not in cell else Decimal("nan")
    except InvalidOperation:
        number = Decimal("nan")
    exponent = number.as_tuple().exponent
    value = float(number)
    if not isinstance(exponent, int) or not math.isfinite(value):
        raise MaterialTableError(cell_location, f"is {format_value(cell)}, not a number", rule.hint())
    if name.endswith(UNCERTAINTY_SUFFIX):
        rule = NumberRule(f"one standard deviation of {rule.meaning}", rule.unit, positive=True)
    bound = rule.violated_bound(value)
    if bound:
        raise MaterialTableError(cell_location, f"is {value!r}, must be {bound}", rule.hint())
    return value, 10.0 ** min(exponent, MAX_DECIMAL_EXPONENT)


def _require_rows(table: MaterialTable) -> None:
    if len(table.rows) < MIN_ROWS:
        problem = f"has {len(table.rows)} rows of a frequency above zero, must have at least {MIN_ROWS}"
        raise MaterialTableError(table.path, problem, "measure at more frequencies")
    if len(table.rows) > MAX_ROWS:
        problem = f"has {len(table.rows)} rows, at most {MAX_ROWS} are fitted"
        raise MaterialTableError(table.path, problem, "average the repeats at one frequency")
    for row in table.static_rows:
        if not _has_uncertainty(row, "storage_modulus"):
            problem = "a static row gives no storage_modulus with its uncertainty"
            raise MaterialTableError(row.where, problem, "add both, or remove the row")
    if not table.modulus_pairs():
        problem = "no pair of columns gives a complex modulus with uncertainties in every row"
        pairs = "; ".join(f"{first} and {second}" for first, second in MODULUS_PAIRS)
        raise MaterialTableError(table.path, problem, f"give, with {UNCERTAINTY_SUFFIX} columns, one of: {pairs}")
