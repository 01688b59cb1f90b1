"""The formulas of a robot file, each parsed as data and validated before use."""

from __future__ import annotations

from collections.abc import Callable

from tautwire_fmu.laws.expression import expression_errors
from tautwire_fmu.laws.formula import VARIABLES_BY_TARGET

from .checked_table import CheckedTable
from .robot import Formula


def read_formulas(root: CheckedTable, cable_reader: Callable[[CheckedTable], tuple[int, ...]]) -> tuple[Formula, ...]:
    """Reads ``[formula]`` or ``[[formula]]`` of a robot file, if any; ``cable_reader`` returns the cables of a table.

    Raises RobotFileError.
    """
    if "formula" not in root.content:
        return ()
    return tuple(
        formula for table in root.table_or_tables("formula") for formula in _read_formula_table(table, cable_reader)
    )


def _read_formula_table(table: CheckedTable, cable_reader: Callable[[CheckedTable], tuple[int, ...]]) -> list[Formula]:
    table.require_known((*VARIABLES_BY_TARGET, "cables"))
    targets = [target for target in VARIABLES_BY_TARGET if target in table.content]
    if not targets:
        table.refuse("", "holds no formula", 'write one, as in force_x = "-20 * vx"')
    elif "cables" in table.content and "tension" not in targets:
        table.refuse("cables", "only a formula of the tension acts in cables", "remove cables")
    formulas = []
    for place in targets:
        text = table.text(place, 'write it as a text, as in "-20 * vx"')
        if text is None:
            continue
        for error in expression_errors(text, VARIABLES_BY_TARGET[place]):
            table.refuse(place, f"character {error.position}: {error.problem}", error.hint)
        formulas.append(Formula(place, text, cable_reader(table) if place == "tension" else ()))
    return formulas
