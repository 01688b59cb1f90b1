"""The effects and formulas of a robot file, each validated."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite

from tautwire_fmu.laws.effects import BY_NAME, Effect, Parameter
from tautwire_fmu.laws.expression import evaluate, expression_errors, parse_expression
from tautwire_fmu.laws.formula import FORCE_TARGETS, PLATFORM_VARIABLES, VARIABLES_BY_TARGET
from tautwire_fmu.laws.mathematics import REAL

from ..errors import format_value
from ..name_suggestions import suggest_name
from ..validation import NumberRule
from .active_effects import shifts_position, total_mass
from .checked_table import CheckedTable
from .platform_reader import refuse_keys_of_rigid_bodies
from .schema import AXES, PER_CABLE_COMPONENTS, EffectSetting, Formula, Point, Robot


def read_effects(table: CheckedTable, cable_count: int, is_rigid: bool) -> tuple[EffectSetting, ...]:
    """Reads the effect settings of ``[effect]`` in a robot file; errors go to the table's sink.

    Of a platform that is not ``is_rigid``, a point mass, effects and parameters of rigid bodies are refused.
    """
    settings: list[EffectSetting] = []
    if not is_rigid:
        refuse_keys_of_rigid_bodies(table, tuple(name for name in BY_NAME if BY_NAME[name].needs_rigid_body))
    for name in table.content:
        if name not in BY_NAME:
            table.refuse(name, "is not a known effect", f"write {suggest_name(name, BY_NAME)}, or remove it")
            continue
        tables_by_cable: dict[int, str] = {}
        of_tracker = ""
        for effect_table in table.table_or_tables(name):
            setting = _read_effect(effect_table, BY_NAME[name], cable_count)
            if not (is_rigid or BY_NAME[name].needs_rigid_body):
                rigid_keys = tuple(p.name for p in BY_NAME[name].parameters if p.needs_rigid_body)
                refuse_keys_of_rigid_bodies(effect_table, rigid_keys)
            # Effects that act on no cable count as cable 0, so that they too are set once.
            for cable in setting.cables or (0,):
                if cable in tables_by_cable:
                    which = f"cable {cable}" if cable else "the robot"
                    problem = f"is set twice for {which}, in {tables_by_cable[cable]} too"
                    effect_table.refuse("cables" if cable else "", problem, "set it once")
                tables_by_cable[cable] = effect_table.key
            if shifts_position(setting):
                if of_tracker:
                    effect_table.refuse("", f"is set twice for the tracker, in {of_tracker} too", "set it once")
                of_tracker = effect_table.key
            settings.append(setting)
    return tuple(settings)


def _read_effect(table: CheckedTable, effect: Effect, cable_count: int) -> EffectSetting:
    per_cable = effect.component in PER_CABLE_COMPONENTS
    if "cables" in table.content and not per_cable:
        table.refuse("cables", f"{effect.name} acts on the {effect.component}", "remove cables")
    names = [parameter.name for parameter in effect.parameters]
    table.require_known([*names, "cables"])
    values = {each.name: table.number(each.name, _parameter_rule(each)) for each in effect.parameters}
    # A missing number without a neutral value is reported already.
    if not any(name in table.content for name in names) and all(each.neutral is not None for each in effect.parameters):
        hint = f"give {effect.parameters[0].description}, as in {names[0]} = {effect.parameters[0].start:g}"
        table.refuse("", "sets no parameter", hint)
    return EffectSetting(effect.name, values, read_cable_list(table, cable_count) if per_cable else ())


def _parameter_rule(parameter: Parameter) -> NumberRule:
    bounds = (parameter.minimum, parameter.maximum)
    return NumberRule(parameter.description, parameter.unit, *bounds, default=parameter.neutral)


def require_positive_mass(root: CheckedTable, robot: Robot) -> None:
    """Refuses effects and formulas that leave the platform no mass at the start."""
    adds_mass = any(BY_NAME[setting.name].inertia is not None for setting in robot.effects)
    formula = next((each for each in robot.formulas if each.target == "mass"), None)
    if not (adds_mass or formula):
        return
    try:
        mass = float(total_mass(robot))
    except (ArithmeticError, ValueError):
        return
    # What is no number is NaN here, and refused already.
    if mass <= 0.0 < robot.platform.mass:
        problem = f"with it the platform has a mass of {mass:g} kg"
        root.refuse("formula" if formula else "effect", problem, f"remove less than its {robot.platform.mass:g} kg")


def read_cable_list(table: CheckedTable, cable_count: int) -> tuple[int, ...]:
    """Reads the cables, from 1, on which a table acts; all if it names none."""
    if "cables" not in table.content:
        return tuple(range(1, cable_count + 1))
    hint = "list cables as in cables = [2], or remove the key for all cables"
    entries = table.content["cables"]
    if not isinstance(entries, list) or not entries:
        problem = "is empty" if entries == [] else f"is {format_value(entries)}, not a list of cables"
        table.refuse("cables", problem, hint)
        return ()
    cable_numbers: set[int] = set()
    for cable in entries:
        if isinstance(cable, bool) or not isinstance(cable, int) or not 1 <= cable <= cable_count:
            table.refuse("cables", f"has {format_value(cable)}, must be from 1 to {cable_count}", hint)
        elif cable in cable_numbers:
            table.refuse("cables", f"names cable {cable} twice", hint)
        else:
            cable_numbers.add(cable)
    return tuple(sorted(cable_numbers))


def read_formulas(
    root: CheckedTable, cable_reader: Callable[[CheckedTable], tuple[int, ...]], start: Point
) -> tuple[Formula, ...]:
    """Reads ``[formula]`` or ``[[formula]]`` of a robot file, if any; ``cable_reader`` returns the cables of a table.

    Raises RobotFileError.
    """
    if "formula" not in root.content:
        return ()
    return tuple(
        formula
        for table in root.table_or_tables("formula")
        for formula in _read_formula_table(table, cable_reader, start)
    )


def _read_formula_table(
    table: CheckedTable, cable_reader: Callable[[CheckedTable], tuple[int, ...]], start: Point
) -> list[Formula]:
    table.require_known((*VARIABLES_BY_TARGET, "cables"))
    targets = [target for target in VARIABLES_BY_TARGET if target in table.content]
    if not targets:
        table.refuse("", "contains no formula", 'write one, as in force_x = "-20 * vx"')
    elif "cables" in table.content and "tension" not in targets:
        table.refuse("cables", "only a tension formula acts in cables", "remove cables")
    formulas = []
    for target in targets:
        text = table.text(target, 'write it as text, as in "-20 * vx"')
        if text is None:
            continue
        errors = expression_errors(text, VARIABLES_BY_TARGET[target])
        for error in errors:
            table.refuse(target, f"character {error.position}: {error.problem}", error.hint)
        if target in FORCE_TARGETS and not errors and not _has_value_at_rest(text, start):
            hint = "keep it finite where nothing moves, as in -20*vx/sqrt(vx**2 + 1e-6)"
            table.refuse(target, f"{text!r} has no value at the start, at rest", hint)
        formulas.append(Formula(target, text, cable_reader(table) if target == "tension" else ()))
    return formulas


def _has_value_at_rest(text: str, start: Point) -> bool:
    values = dict.fromkeys(PLATFORM_VARIABLES, 0.0) | dict(zip(AXES, start, strict=True))
    try:
        return isfinite(evaluate(REAL, parse_expression(text, PLATFORM_VARIABLES), values))
    except (ArithmeticError, ValueError):
        return False
