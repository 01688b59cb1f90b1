"""The formulas of a robot file: each read as data and checked before anything else sees it."""

from __future__ import annotations

from collections.abc import Callable

from tautwire_fmu.laws.expression import expression_faults
from tautwire_fmu.laws.formula import PLACES

from .checked_table import CheckedTable
from .robot import Formula


def formulas_in(root: CheckedTable, cables_of: Callable[[CheckedTable], tuple[int, ...]]) -> tuple[Formula, ...]:
    """Of a robot file's ``[formula]`` or ``[[formula]]``, if any; ``cables_of`` tells in which cables a table acts.

    Raises RobotFileError.
    """
    if "formula" not in root.content:
        return ()
    return tuple(formula for table in root.one_or_several("formula") for formula in _formulas_of(table, cables_of))


def _formulas_of(table: CheckedTable, cables_of: Callable[[CheckedTable], tuple[int, ...]]) -> list[Formula]:
    table.require_known((*PLACES, "cables"))
    places = [place for place in PLACES if place in table.content]
    if not places:
        table.refuse("", "holds no formula", 'write one, as in force_x = "-20 * vx"')
    elif "cables" in table.content and "tension" not in places:
        table.refuse("cables", "only a formula of the tension acts in cables", "remove cables")
    found = []
    for place in places:
        text = table.text(place, 'write it as a text, as in "-20 * vx"')
        if text is None:
            continue
        for error in expression_faults(text, PLACES[place]):
            table.refuse(place, f"character {error.place}: {error.problem}", error.mend)
        found.append(Formula(place, text, cables_of(table) if place == "tension" else ()))
    return found
