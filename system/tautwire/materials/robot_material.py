"""Puts a fitted rope into a robot file: declared modulus and damping, and the ``relaxation`` effect beside them.

T = S (E eps + c deps/dt + sum_k E_k (eps - e_k)) + T0,   de_k/dt = (eps - e_k) / tau_k
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from tautwire_fmu.laws.effects import BY_NAME

from ..errors import InputError
from ..robot.schema import EffectSetting, Robot
from .viscoelastic_model import Material, MaxwellBranch

# Effects of a robot that the fitted constants and branches replace.
REPLACED_EFFECTS = ("modulus", "damping", "relaxation")


@dataclass(frozen=True)
class RobotMaterial:
    """A rope as a robot file declares it: long-term ``modulus`` in Pa; ``damping`` in Pa s; Maxwell ``branches``."""

    modulus: float
    damping: float
    branches: tuple[MaxwellBranch, ...]

    @property
    def relaxation(self) -> Mapping[str, float]:
        """The table ``[effect.relaxation]``: ``modulus`` (Pa) and ``time`` (s), ``modulus_2`` and ``time_2`` ..."""
        values: dict[str, float] = {}
        for number, branch in enumerate(self.branches, 1):
            suffix = "" if number == 1 else f"_{number}"
            values |= {f"modulus{suffix}": branch.modulus, f"time{suffix}": branch.relaxation_time}
        return values

    def text(self) -> str:
        """The lines for a robot file."""
        lines = [
            "# in every [[cable]]; the area must be the one that the test's stresses were taken on",
            f"modulus = {self.modulus!r}  # Pa, long-term",
            f"damping = {self.damping!r}  # Pa s",
        ]
        if self.branches:
            lines += ["", "[effect.relaxation]  # generalised Maxwell branches beside the modulus above"]
        for name, value in self.relaxation.items():
            lines.append(f"{name} = {value!r}  # {'Pa' if name.startswith('modulus') else 's'}")
        return "\n".join(lines) + "\n"


def robot_material(material: Material) -> RobotMaterial:
    """Restrict a material to what a robot file can hold: modulus, damping and branches.

    A branch faster than the effect allows acts as a damper of ``E_k tau_k``, and becomes one.
    """
    min_relaxation_time = next(each.minimum for each in BY_NAME["relaxation"].parameters if each.name == "time")
    resolved_branches = tuple(branch for branch in material.branches if branch.relaxation_time >= min_relaxation_time)
    equivalent_damping = sum(
        branch.modulus * branch.relaxation_time
        for branch in material.branches
        if branch.relaxation_time < min_relaxation_time
    )
    return RobotMaterial(material.modulus, material.damping + equivalent_damping, resolved_branches)


def with_material(robot: Robot, rope: RobotMaterial) -> Robot:
    """The robot with this rope on every cable, replacing its modulus, damping and relaxation."""
    cables = tuple(replace(cable, modulus=rope.modulus, damping=rope.damping) for cable in robot.cables)
    other_effects = tuple(setting for setting in robot.effects if setting.name not in REPLACED_EFFECTS)
    plain = replace(robot, cables=cables, effects=other_effects)
    if not rope.branches:
        return plain
    neutral_values = {each.name: each.neutral for each in BY_NAME["relaxation"].parameters if each.neutral is not None}
    return plain.with_effect(EffectSetting("relaxation", {**neutral_values, **rope.relaxation}, robot.cable_numbers))


def declared_material(robot: Robot, where: str) -> Material:
    """The one pair of modulus and damping of a robot's cables; raises InputError where they differ."""
    pairs = {(cable.modulus, cable.damping) for cable in robot.cables}
    if len(pairs) > 1:
        problem = f"its cables have {len(pairs)} different pairs of modulus and damping"
        raise InputError(where, problem, "give a robot whose cables are all of the tested rope")
    modulus, damping = pairs.pop()
    return Material(modulus, damping)
