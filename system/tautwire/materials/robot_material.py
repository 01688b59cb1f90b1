"""A fitted rope in a robot file: declared modulus and damping, and the ``relaxation`` effect beside them.

T = S (E eps + c deps/dt + sum_k E_k (eps - e_k)) + T0,   de_k/dt = (eps - e_k) / tau_k
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from tautwire_fmu.laws.effects import BY_NAME

from ..errors import InputError
from ..robots.robot import EffectSetting, Robot
from .modulus import Branch, Material

# What the declared constants and the branches replace in a robot.
REPLACED = ("modulus", "damping", "relaxation")


@dataclass(frozen=True)
class RobotMaterial:
    """What a robot file says of the rope: ``modulus`` in Pa, long-term; ``damping`` in Pa s; Maxwell ``branches``."""

    modulus: float
    damping: float
    branches: tuple[Branch, ...]

    @property
    def relaxation(self) -> Mapping[str, float]:
        """The table ``[effect.relaxation]``: ``modulus`` (Pa) and ``time`` (s), ``modulus_2`` and ``time_2`` ..."""
        values: dict[str, float] = {}
        for number, branch in enumerate(self.branches, 1):
            suffix = "" if number == 1 else f"_{number}"
            values |= {f"modulus{suffix}": branch.modulus, f"time{suffix}": branch.time}
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
    """The part of a material that a robot file can hold: modulus, damping and branches.

    A branch too quick for the effect acts as a damper of ``E_k tau_k`` there, and becomes one.
    """
    shortest = next(each.minimum for each in BY_NAME["relaxation"].parameters if each.name == "time")
    slow = tuple(branch for branch in material.branches if branch.time >= shortest)
    quick = sum(branch.modulus * branch.time for branch in material.branches if branch.time < shortest)
    return RobotMaterial(material.modulus, material.damping + quick, slow)


def with_material(robot: Robot, rope: RobotMaterial) -> Robot:
    """The robot with this rope on every cable, in place of what it said of modulus, damping and relaxation."""
    cables = tuple(replace(cable, modulus=rope.modulus, damping=rope.damping) for cable in robot.cables)
    kept = tuple(setting for setting in robot.effects if setting.name not in REPLACED)
    plain = replace(robot, cables=cables, effects=kept)
    if not rope.branches:
        return plain
    absent = {each.name: each.neutral for each in BY_NAME["relaxation"].parameters if each.neutral is not None}
    return plain.with_effect(EffectSetting("relaxation", {**absent, **rope.relaxation}, robot.cable_numbers))


def declared_material(robot: Robot, where: str) -> Material:
    """The one pair of modulus and damping of a robot's cables; raises InputError where they differ."""
    pairs = {(cable.modulus, cable.damping) for cable in robot.cables}
    if len(pairs) > 1:
        problem = f"its cables have {len(pairs)} different pairs of modulus and damping"
        raise InputError(where, problem, "give a robot whose cables are all of the tested rope")
    modulus, damping = pairs.pop()
    return Material(modulus, damping)
