"""Hypotheses of a trace: each form of each effect, on all cables and on each alone."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from tautwire_fmu.laws.effects import (
    ALL,
    ANCHOR,
    ATTACHMENT,
    BY_NAME,
    HANGING_LOAD,
    PAYLOAD,
    STIFFENING,
    Effect,
    Parameter,
)

from ..robot.schema import PER_CABLE_COMPONENTS, EffectSetting, Robot
from ..robot.symbolic_model import FORMULA_INDEX, FreeParameter

# All exit points moved alike are the platform's start and its sensor moved, the other way; all attachments its frame.
SINGLE_CABLE_EFFECTS = (ANCHOR, ATTACHMENT)
# Forms of the platform's position sensors, whichever cables are named.
PLATFORM_SENSOR_FORMS = (
    ("position_gain",),
    ("position_delay",),
    ("position_offset_x", "position_offset_y", "position_offset_z"),
)


@dataclass(frozen=True)
class Hypothesis:
    """One effect on some cables, none where it acts on the platform; ``form`` are the parameters that are fitted.

    The other parameters of the effect stay neutral. Without a form it is the effect's first.
    """

    effect: Effect
    cables: tuple[int, ...]
    form: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.form:
            object.__setattr__(self, "form", self.effect.forms[0])

    def label(self, robot: Robot) -> str:
        """The effect and, where it does not act on all cables, which it acts on."""
        return _label(self.effect, self.cables, robot)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those that are fitted."""
        return tuple(parameter for parameter in self.effect.parameters if parameter.name in self.form)

    def overlaps(self, other: Hypothesis) -> bool:
        """Whether the other is the same effect on a cable that both share, or on the platform."""
        return self.effect is other.effect and (not self.cables or bool(set(self.cables) & set(other.cables)))

    def setting(self, robot: Robot, values: Mapping[str, float] | None = None) -> EffectSetting:
        """The effect switched on at ``values``, where fits begin without them."""
        setting_values = dict(self._start_values(robot)) if values is None else dict(values)
        return EffectSetting(self.effect.name, self.effect.completed_values(setting_values), self.cables)

    def neutral(self, robot: Robot, cables: tuple[int, ...]) -> EffectSetting:
        """The effect on some of the cables, switched on and absent."""
        declared = {p.name: declared_value(robot, p, cables) for p in self.effect.parameters}
        declared_values = {name: value for name, value in declared.items() if value is not None}
        return EffectSetting(self.effect.name, self.effect.completed_values(declared_values), cables)

    def _start_values(self, robot: Robot) -> Iterator[tuple[str, float]]:
        for parameter in self.effect.parameters:
            declared = declared_value(robot, parameter, self.cables)
            if parameter.name in self.form:
                yield parameter.name, parameter.start if not declared else parameter.start_ratio * declared
            elif declared is not None:
                yield parameter.name, declared


def with_hypothesis(accepted: Sequence[Hypothesis], new: Hypothesis) -> list[Hypothesis]:
    """The accepted hypotheses with a new one, which takes its cables from others of the same effect."""
    disjoint = []
    for old in accepted:
        cables = tuple(cable for cable in old.cables if cable not in new.cables)
        if not old.overlaps(new):
            disjoint.append(old)
        elif cables:
            disjoint.append(Hypothesis(old.effect, cables, old.form))
    return [*disjoint, new]


def hypotheses(robot: Robot, has_disturbance: bool = False) -> tuple[Hypothesis, ...]:
    """All single effects that could act on a robot, each in its forms that contain no smaller one.

    Beside a disturbance, which hides how a load swings, a hanging load too: sag, or offsets, would get its credit. And
    ropes that stiffen, for which a search would take softer and stiffer ropes, slack and hysteresis one by one.
    """
    unlisted = (Hypothesis(HANGING_LOAD, ()), Hypothesis(STIFFENING, robot.cable_numbers))
    candidates = list(unlisted) if has_disturbance else []
    for effect in ALL:
        for form in _minimal_forms(effect.forms_on(robot.platform.is_rigid_body)):
            if effect.component not in PER_CABLE_COMPONENTS:
                candidates.append(Hypothesis(effect, (), form))
                continue
            if effect not in SINGLE_CABLE_EFFECTS:
                candidates.append(Hypothesis(effect, robot.cable_numbers, form))
            if form not in PLATFORM_SENSOR_FORMS:
                candidates += [Hypothesis(effect, (cable,), form) for cable in robot.cable_numbers]
    return tuple(candidates)


def searched_hypotheses(robot: Robot, has_disturbance: bool = False) -> tuple[Hypothesis, ...]:
    """The hypotheses of a search: :func:`hypotheses`, and a payload beside the centre of mass of a rigid platform.

    Without that sag of all ropes, which has a moment too, takes its place in the first round.
    """
    larger = with_larger_forms([Hypothesis(PAYLOAD, ())], robot)
    return (*hypotheses(robot, has_disturbance), *larger)


def with_larger_forms(accepted: Sequence[Hypothesis], robot: Robot) -> list[Hypothesis]:
    """Each accepted hypothesis with one more form of its effect."""
    larger = []
    for old in accepted:
        for form in old.effect.forms_on(robot.platform.is_rigid_body):
            names = tuple(p.name for p in old.effect.parameters if p.name in (*old.form, *form))
            if set(names) != set(old.form):
                larger.append(Hypothesis(old.effect, old.cables, names))
    return list(dict.fromkeys(larger))


def labels_by_effect(accepted: Sequence[Hypothesis], robot: Robot) -> list[str]:
    """Label of each hypothesis, with the cables of all that have its effect: with a value each they are one effect."""
    cables: dict[Effect, set[int]] = {}
    for hypothesis in accepted:
        cables.setdefault(hypothesis.effect, set()).update(hypothesis.cables)
    return [_label(each.effect, tuple(sorted(cables[each.effect])), robot) for each in accepted]


def split_by_cable(accepted: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Single-cable versions of each hypothesis whose cables share one value."""
    return [Hypothesis(a.effect, (cable,), a.form) for a in accepted if len(a.cables) > 1 for cable in a.cables]


def _label(effect: Effect, cables: tuple[int, ...], robot: Robot) -> str:
    if cables in ((), robot.cable_numbers):
        return effect.name
    return f"{effect.name} of cable {', '.join(map(str, cables))}"


def _minimal_forms(forms: Sequence[tuple[str, ...]]) -> list[tuple[str, ...]]:
    return [form for form in forms if not any(set(other) < set(form) for other in forms)]


def declared_value(robot: Robot, parameter: Parameter, cables: tuple[int, ...]) -> float | None:
    """Declared value of a parameter: the mean over its cables; None if the robot file declares nothing."""
    if parameter.neutral is not None:
        return None
    values = [float(getattr(robot.cables[cable - 1], parameter.name)) for cable in cables]
    return sum(values) / len(values)


def free_parameters(robot: Robot, chosen: Collection[Hypothesis]) -> tuple[FreeParameter, ...]:
    """The parameters that the chosen hypotheses fit, in the robot's order, and the numbers of its formulas.

    What else the file declares stays fixed.
    """
    numbers = dict.fromkeys(name for formula in robot.formulas for name in formula.numbers)
    forms = {(hypothesis.effect.name, hypothesis.cables): hypothesis.form for hypothesis in chosen}
    of_effects = (
        FreeParameter(index, parameter.name)
        for index, setting in enumerate(robot.effects)
        for parameter in BY_NAME[setting.name].parameters
        if parameter.name in forms.get((setting.name, setting.cables), ())
    )
    return (*of_effects, *(FreeParameter(FORMULA_INDEX, name) for name in numbers))


def value_of(robot: Robot, free: FreeParameter) -> float:
    """The value that the robot has."""
    if free.effect_index == FORMULA_INDEX:
        return next(formula.numbers[free.name] for formula in robot.formulas if free.name in formula.numbers)
    return robot.effects[free.effect_index].values[free.name]


def with_values(robot: Robot, free: Sequence[FreeParameter], values: Mapping[FreeParameter, float]) -> Robot:
    """The robot with its effects' parameters, and the numbers of its formulas, set anew."""
    numbers = {parameter.name: values[parameter] for parameter in free if parameter.effect_index == FORMULA_INDEX}
    formulas = (
        replace(f, numbers={name: numbers.get(name, old) for name, old in f.numbers.items()}) for f in robot.formulas
    )
    robot = replace(robot, formulas=tuple(formulas))
    effects = list(robot.effects)
    for parameter in free:
        if parameter.effect_index == FORMULA_INDEX:
            continue
        old = effects[parameter.effect_index]
        effects[parameter.effect_index] = EffectSetting(
            old.name, {**old.values, parameter.name: values[parameter]}, old.cables
        )
    return replace(robot, effects=tuple(effects))
