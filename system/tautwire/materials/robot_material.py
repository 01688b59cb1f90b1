"""Puts a fitted rope into a robot file: declared modulus and damping, and the ``relaxation`` effect beside them.

T = S (E eps + c deps/dt + sum_k E_k (eps - e_k)) + T0,   de_k/dt = (eps - e_k) / tau_k
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from statistics import fmean

from scipy.stats import norm

from tautwire_fmu.laws.effects import BY_NAME

from ..errors import ArgumentError, InputError
from ..robot.schema import EffectSetting, Robot
from .material_verdict import Estimate
from .modulus_intervals import CONFIDENCE_LEVEL
from .viscoelastic_model import MAX_BRANCHES, Material, MaxwellBranch

# Effects of a robot that the fitted constants and branches replace.
REPLACED_EFFECTS = ("modulus", "damping", "relaxation")
INTERVAL_SIGMAS = float(norm.isf(0.5 * (1.0 - CONFIDENCE_LEVEL)))


@dataclass(frozen=True)
class RobotMaterial:
    """A rope as a robot file declares it: long-term ``modulus`` in Pa; ``damping`` in Pa s; Maxwell ``branches``.

    ``modulus_uncertainty`` and ``damping_uncertainty`` are standard deviations in the same units.
    """

    modulus: float
    damping: float
    branches: tuple[MaxwellBranch, ...]
    modulus_uncertainty: float = 0.0
    damping_uncertainty: float = 0.0

    @property
    def relaxation(self) -> Mapping[str, float]:
        """The table ``[effect.relaxation]``: ``modulus`` (Pa) and ``time`` (s), ``modulus_2`` and ``time_2`` ..."""
        values: dict[str, float] = {}
        for branch, (modulus, time) in zip(self.branches, _branch_names(), strict=False):
            values |= {modulus: branch.modulus, time: branch.relaxation_time}
        return values

    def text(self) -> str:
        """The lines for a robot file."""
        lines = [
            "# in every [[cable]]; the area must be the one that the test's stresses were taken on",
            f"modulus = {self.modulus!r}  # Pa, long-term",
            f"damping = {self.damping!r}  # Pa s",
            f"modulus_uncertainty = {self.modulus_uncertainty!r}  # Pa, standard deviation",
            f"damping_uncertainty = {self.damping_uncertainty!r}  # Pa s, standard deviation",
        ]
        if self.branches:
            lines += ["", "[effect.relaxation]  # generalised Maxwell branches beside the modulus above"]
        for name, value in self.relaxation.items():
            lines.append(f"{name} = {value!r}  # {'Pa' if name.startswith('modulus') else 's'}")
        return "\n".join(lines) + "\n"


def robot_material(material: Material, estimates: Iterable[Estimate] = ()) -> RobotMaterial:
    """Restrict a material to what a robot file can hold: modulus, damping and branches.

    A branch faster than the effect allows acts as a damper of ``E_k tau_k``, and becomes one, uncertain by all of it.
    The other uncertainties are those of the ``estimates`` of modulus and damping.

    Raises ArgumentError where there are more branches than the effect has.
    """
    min_relaxation_time = next(each.minimum for each in BY_NAME["relaxation"].parameters if each.name == "time")
    resolved_branches = tuple(branch for branch in material.branches if branch.relaxation_time >= min_relaxation_time)
    equivalent_damping = sum(
        branch.modulus * branch.relaxation_time
        for branch in material.branches
        if branch.relaxation_time < min_relaxation_time
    )
    if len(resolved_branches) > MAX_BRANCHES:
        problem = f"has {len(resolved_branches)} branches, a robot file holds {MAX_BRANCHES}"
        raise ArgumentError("robot_material: material", material, problem, "fit fewer branches")
    deviations = {each.effect: _standard_deviation(each) for each in estimates}
    return RobotMaterial(
        material.modulus,
        material.damping + equivalent_damping,
        resolved_branches,
        deviations.get("modulus", 0.0),
        math.hypot(deviations.get("damping", 0.0), equivalent_damping) if deviations else 0.0,
    )


def _standard_deviation(estimate: Estimate) -> float:
    """That of a normal distribution with as wide an interval; twice the other side's width where one is open."""
    is_open = (estimate.low_is_open, estimate.high_is_open)
    widths = (estimate.value - estimate.low, estimate.high - estimate.value)
    closed_widths = [width for width, side_is_open in zip(widths, is_open, strict=True) if not side_is_open]
    return fmean(closed_widths or widths) / INTERVAL_SIGMAS


def with_material(robot: Robot, rope: RobotMaterial) -> Robot:
    """The robot with this rope on every cable, replacing its modulus, damping, their uncertainties and relaxation."""
    cables = tuple(
        replace(
            cable,
            modulus=rope.modulus,
            damping=rope.damping,
            modulus_uncertainty=rope.modulus_uncertainty,
            damping_uncertainty=rope.damping_uncertainty,
        )
        for cable in robot.cables
    )
    other_effects = tuple(setting for setting in robot.effects if setting.name not in REPLACED_EFFECTS)
    plain = replace(robot, cables=cables, effects=other_effects)
    if not rope.branches:
        return plain
    neutral_values = {each.name: each.neutral for each in BY_NAME["relaxation"].parameters if each.neutral is not None}
    return plain.with_effect(EffectSetting("relaxation", {**neutral_values, **rope.relaxation}, robot.cable_numbers))


def declared_material(robot: Robot, where: str) -> Material:
    """The one rope of a robot's cables, as declared and as its effects set it; raises InputError where they differ."""
    ropes = {_acting_material(robot, cable) for cable in robot.cable_numbers}
    if len(ropes) > 1:
        problem = f"its cables have {len(ropes)} different ropes, by modulus, damping and effects that set these"
        raise InputError(where, problem, "give a robot whose cables are all of the tested rope")
    return ropes.pop()


def _acting_material(robot: Robot, cable: int) -> Material:
    """Modulus, damping and branches that act in a cable, counted from 1."""
    declared = robot.cables[cable - 1]
    values = {each.name: each.values for each in robot.effects_on_cable(cable) if each.name in REPLACED_EFFECTS}
    branches: tuple[MaxwellBranch, ...] = ()
    if "relaxation" in values:
        completed = BY_NAME["relaxation"].completed_values(values["relaxation"])
        branches = tuple(MaxwellBranch(completed[modulus], completed[time]) for modulus, time in _branch_names())
    return Material(
        modulus=values.get("modulus", {}).get("modulus", declared.modulus),
        damping=values.get("damping", {}).get("damping", declared.damping),
        branches=tuple(branch for branch in branches if branch.modulus > 0.0),
    )


def _branch_names() -> list[tuple[str, str]]:
    """Parameters of the effect for modulus and time of each branch."""
    suffixes = ["", *(f"_{number}" for number in range(2, MAX_BRANCHES + 1))]
    return [(f"modulus{suffix}", f"time{suffix}") for suffix in suffixes]
