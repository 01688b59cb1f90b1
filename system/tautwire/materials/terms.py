"""Model structures of the complex modulus, and their free parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

from .modulus import Material, MaxwellBranch

MAX_BRANCHES = 3
# "modulus": friction that grows with amplitude, a constant loss modulus; "stress": one stress at all amplitudes.
Hysteresis = Literal["none", "modulus", "stress"]


class FreeParameter(NamedTuple):
    """One free parameter: the ``effect`` that it belongs to, its ``name``, and its unit."""

    effect: str
    name: str
    unit: str


@dataclass(frozen=True)
class ModelStructure:
    """Model structure: which terms of the complex modulus are free beside the long-term modulus, which always is."""

    damping: bool = False
    branches: int = 0
    hysteresis: Hysteresis = "none"
    delay: bool = False

    @property
    def effects(self) -> frozenset[str]:
        """The free terms by the names of effects in robot files."""
        present = {
            "damping": self.damping,
            "relaxation": self.branches > 0,
            "hysteresis": self.hysteresis != "none",
            "sensor_delay": self.delay,
        }
        return frozenset(name for name, is_present in present.items() if is_present)

    @property
    def family(self) -> ModelStructure:
        """The same structure with one branch where there are any."""
        return replace(self, branches=min(self.branches, 1))

    def without(self, effect: str) -> ModelStructure:
        """The same structure without one of its effects."""
        return ModelStructure(
            damping=self.damping and effect != "damping",
            branches=0 if effect == "relaxation" else self.branches,
            hysteresis="none" if effect == "hysteresis" else self.hysteresis,
            delay=self.delay and effect != "sensor_delay",
        )

    def includes(self, other: ModelStructure) -> bool:
        """Whether this structure includes all terms of the other, whatever the number of branches."""
        same_hysteresis = other.hysteresis in ("none", self.hysteresis)
        return self.effects >= other.effects and same_hysteresis

    @property
    def label(self) -> str:
        """The structure in words."""
        words = ["damping"] * self.damping
        if self.branches:
            words.append("relaxation" if self.branches == 1 else f"relaxation ({self.branches} branches)")
        if self.hysteresis != "none":
            words.append("hysteresis" if self.hysteresis == "modulus" else "hysteresis (one stress)")
        return " + ".join([*words, *(["sensor_delay"] * self.delay)]) or "elastic"

    @property
    def linear_count(self) -> int:
        """Number of parameters in which the modulus is linear; they come first."""
        return 1 + self.damping + (self.hysteresis != "none") + self.branches

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Free parameters: moduli and damping, then relaxation times and delay; branches from the shortest time on."""
        suffixes = ["", *(f"_{number}" for number in range(2, self.branches + 1))][: self.branches]
        kinds = {"none": [], "modulus": ["loss_modulus"], "stress": ["friction_stress"]}
        return (
            FreeParameter("modulus", "modulus", "Pa"),
            *([FreeParameter("damping", "damping", "Pa s")] if self.damping else []),
            *(FreeParameter("hysteresis", kind, "Pa") for kind in kinds[self.hysteresis]),
            *(FreeParameter("relaxation", f"modulus{suffix}", "Pa") for suffix in suffixes),
            *(FreeParameter("relaxation", f"time{suffix}", "s") for suffix in suffixes),
            *([FreeParameter("sensor_delay", "delay", "s")] if self.delay else []),
        )

    def material(self, values: Sequence[float]) -> Material:
        """The material whose parameters have these values, in SI units."""
        remaining = iter([float(value) for value in values])
        modulus = next(remaining)
        damping = next(remaining) if self.damping else 0.0
        loss = next(remaining) if self.hysteresis == "modulus" else 0.0
        friction = next(remaining) if self.hysteresis == "stress" else 0.0
        moduli = [next(remaining) for _ in range(self.branches)]
        times = [next(remaining) for _ in range(self.branches)]
        branches = tuple(MaxwellBranch(*pair) for pair in zip(moduli, times, strict=True))
        return Material(modulus, damping, branches, loss, friction, next(remaining) if self.delay else 0.0)


def branch_variants(structure: ModelStructure, max_parameters: int) -> tuple[ModelStructure, ...]:
    """The structure with no branch, one, two ..., as long as it has at most ``max_parameters`` parameters."""
    choices = (replace(structure, branches=branches) for branches in range(MAX_BRANCHES + 1))
    return tuple(each for each in choices if len(each.parameters) <= max_parameters)
