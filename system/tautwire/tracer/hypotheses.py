"""The hypotheses that a trace tries: each effect, on all cables and on each alone."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from tautwire_fmu.laws.effects import ALL, BY_NAME, Effect, Parameter

from ..robot import EffectSetting, Robot
from ..symbolic import FreeParameter


@dataclass(frozen=True)
class Hypothesis:
    """One effect on some cables; none where it acts on the platform."""

    effect: Effect
    cables: tuple[int, ...]

    def label(self, robot: Robot) -> str:
        """The effect and, where it does not act on all cables, which it acts on."""
        if self.cables in ((), robot.cable_numbers):
            return self.effect.name
        return f"{self.effect.name} of cable {', '.join(map(str, self.cables))}"

    def overlaps(self, other: Hypothesis) -> bool:
        """Whether the other is the same effect in a place that both share."""
        return self.effect is other.effect and (not self.cables or bool(set(self.cables) & set(other.cables)))

    def setting(self, robot: Robot) -> EffectSetting:
        """The effect switched on at the values where fits begin."""
        return EffectSetting(self.effect.name, dict(self._starts(robot)), self.cables)

    def _starts(self, robot: Robot) -> Iterator[tuple[str, float]]:
        for parameter in self.effect.parameters:
            declared = declared_value(robot, parameter, self.cables)
            yield parameter.name, parameter.start if not declared else parameter.start_ratio * declared


def joined(accepted: Sequence[Hypothesis], new: Hypothesis) -> list[Hypothesis]:
    """The accepted hypotheses and a new one, which has its cables to itself."""
    kept = []
    for old in accepted:
        cables = tuple(cable for cable in old.cables if cable not in new.cables)
        if not old.overlaps(new):
            kept.append(old)
        elif cables:
            kept.append(Hypothesis(old.effect, cables))
    return [*kept, new]


def hypotheses(robot: Robot) -> tuple[Hypothesis, ...]:
    """All single effects that could act on a robot."""
    found: list[Hypothesis] = []
    for effect in ALL:
        if effect.component == "platform":
            found.append(Hypothesis(effect, ()))
        else:
            found.append(Hypothesis(effect, robot.cable_numbers))
            found += [Hypothesis(effect, (cable,)) for cable in robot.cable_numbers]
    return tuple(found)


def declared_value(robot: Robot, parameter: Parameter, cables: tuple[int, ...]) -> float | None:
    """What the robot file declares in the place of a parameter: the mean over its cables; None if nothing."""
    if parameter.neutral is not None:
        return None
    values = [float(getattr(robot.cables[cable - 1], parameter.name)) for cable in cables]
    return sum(values) / len(values)


def free_parameters(robot: Robot, chosen: Collection[Hypothesis]) -> tuple[FreeParameter, ...]:
    """Every parameter of the chosen effects of a robot, in its order; what else the file declares stays fixed."""
    names = {(hypothesis.effect.name, hypothesis.cables) for hypothesis in chosen}
    return tuple(
        FreeParameter(index, parameter.name)
        for index, setting in enumerate(robot.effects)
        if (setting.name, setting.cables) in names
        for parameter in BY_NAME[setting.name].parameters
    )


def with_values(robot: Robot, free: Sequence[FreeParameter], values: Mapping[FreeParameter, float]) -> Robot:
    """The robot with its effects' parameters set anew."""
    effects = list(robot.effects)
    for parameter in free:
        old = effects[parameter.setting]
        effects[parameter.setting] = EffectSetting(
            old.name, {**old.values, parameter.name: values[parameter]}, old.cables
        )
    return replace(robot, effects=tuple(effects))
