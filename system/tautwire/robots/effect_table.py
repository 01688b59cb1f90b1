"""The effects of a robot file, each with its numbers checked."""

from __future__ import annotations

from tautwire_fmu.laws.effects import BY_NAME, Effect, Parameter

from ..errors import shown
from .checked_table import CheckedTable, NumberRule, nearest
from .robot import PER_CABLE, EffectSetting


def effects_in(table: CheckedTable, cable_count: int) -> tuple[EffectSetting, ...]:
    """The settings in a robot file's ``[effect]``; what is wrong goes where the table sends it."""
    settings: list[EffectSetting] = []
    for name in table.content:
        if name not in BY_NAME:
            table.refuse(
                name, "is not an effect that the project knows", f"write {nearest(name, BY_NAME)}, or remove it"
            )
            continue
        taken: dict[int, str] = {}
        for one in table.one_or_several(name):
            setting = _effect(one, BY_NAME[name], cable_count)
            # Effects that act on no cable take the place of cable 0, so that they too are set once.
            for cable in setting.cables or (0,):
                if cable in taken:
                    which = f"cable {cable}" if cable else "the robot"
                    problem = f"is set twice for {which}, in {taken[cable]} too"
                    one.refuse("cables" if cable else "", problem, "set it once")
                taken[cable] = one.key
            settings.append(setting)
    return tuple(settings)


def _effect(table: CheckedTable, effect: Effect, cable_count: int) -> EffectSetting:
    per_cable = effect.component in PER_CABLE
    if "cables" in table.content and not per_cable:
        table.refuse("cables", f"{effect.name} acts on the {effect.component}", "remove cables")
    names = [parameter.name for parameter in effect.parameters]
    table.require_known([*names, "cables"])
    values = {each.name: table.number(each.name, _rule(each)) for each in effect.parameters}
    # A number that has to be given is told to be missing already.
    if not any(name in table.content for name in names) and all(each.neutral is not None for each in effect.parameters):
        mend = f"give {effect.parameters[0].description}, as in {names[0]} = {effect.parameters[0].start:g}"
        table.refuse("", "sets none of its numbers", mend)
    return EffectSetting(effect.name, values, cables_of(table, cable_count) if per_cable else ())


def _rule(parameter: Parameter) -> NumberRule:
    bounds = (parameter.minimum, parameter.maximum)
    return NumberRule(parameter.description, parameter.unit, *bounds, default=parameter.neutral)


def cables_of(table: CheckedTable, cable_count: int) -> tuple[int, ...]:
    """The cables, from 1, in which what a table declares acts; all where it names none."""
    if "cables" not in table.content:
        return tuple(range(1, cable_count + 1))
    mend = "list cables as in cables = [2], or remove the key for all cables"
    given = table.content["cables"]
    if not isinstance(given, list) or not given:
        problem = "is empty" if given == [] else f"is {shown(given)}, not a list of cables"
        table.refuse("cables", problem, mend)
        return ()
    named: set[int] = set()
    for cable in given:
        if isinstance(cable, bool) or not isinstance(cable, int) or not 1 <= cable <= cable_count:
            table.refuse("cables", f"has {shown(cable)}, must be from 1 to {cable_count}", mend)
        elif cable in named:
            table.refuse("cables", f"names cable {cable} twice", mend)
        else:
            named.add(cable)
    return tuple(sorted(named))
