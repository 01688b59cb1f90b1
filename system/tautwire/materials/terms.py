"""What a model of the modulus may hold, and its free parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

from .modulus import Branch, Material

MOST_BRANCHES = 3
# Of friction that grows with amplitude, with a loss modulus of its own, or of one stress at all amplitudes.
Hysteresis = Literal["none", "modulus", "stress"]


class FreeParameter(NamedTuple):
    """One free number: the ``effect`` that it belongs to, its ``name``, and its unit."""

    effect: str
    name: str
    unit: str


@dataclass(frozen=True)
class Terms:
    """Which terms of the complex modulus are free beside the long-term modulus, which always is."""

    damping: bool = False
    branches: int = 0
    hysteresis: Hysteresis = "none"
    delay: bool = False

    @property
    def effects(self) -> frozenset[str]:
        """The terms by the names of effects in robot files."""
        present = {
            "damping": self.damping,
            "relaxation": self.branches > 0,
            "hysteresis": self.hysteresis != "none",
            "sensor_delay": self.delay,
        }
        return frozenset(name for name, there in present.items() if there)

    @property
    def family(self) -> Terms:
        """The same terms with one branch where there are any."""
        return replace(self, branches=min(self.branches, 1))

    def without(self, effect: str) -> Terms:
        """The same terms without one of its effects."""
        return Terms(
            damping=self.damping and effect != "damping",
            branches=0 if effect == "relaxation" else self.branches,
            hysteresis="none" if effect == "hysteresis" else self.hysteresis,
            delay=self.delay and effect != "sensor_delay",
        )

    def holds(self, other: Terms) -> bool:
        """Whether all of the other's terms are here too, whatever the number of branches."""
        same_hysteresis = other.hysteresis in ("none", self.hysteresis)
        return self.effects >= other.effects and same_hysteresis

    @property
    def label(self) -> str:
        """The terms in words."""
        words = ["damping"] * self.damping
        if self.branches:
            words.append("relaxation" if self.branches == 1 else f"relaxation ({self.branches} branches)")
        if self.hysteresis != "none":
            words.append("hysteresis" if self.hysteresis == "modulus" else "hysteresis (one stress)")
        return " + ".join([*words, *(["sensor_delay"] * self.delay)]) or "elastic"

    @property
    def linear_count(self) -> int:
        """Parameters in which the modulus is linear; they come first."""
        return 1 + self.damping + (self.hysteresis != "none") + self.branches

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Moduli and damping, then relaxation times and the delay; branches from the shortest time on."""
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
        numbers = iter([float(value) for value in values])
        modulus = next(numbers)
        damping = next(numbers) if self.damping else 0.0
        loss = next(numbers) if self.hysteresis == "modulus" else 0.0
        friction = next(numbers) if self.hysteresis == "stress" else 0.0
        moduli = [next(numbers) for _ in range(self.branches)]
        times = [next(numbers) for _ in range(self.branches)]
        branches = tuple(Branch(*pair) for pair in zip(moduli, times, strict=True))
        return Material(modulus, damping, branches, loss, friction, next(numbers) if self.delay else 0.0)


def grown(terms: Terms, most_parameters: int) -> tuple[Terms, ...]:
    """The same terms with no branch, one, two ..., as long as there are at most so many parameters."""
    choices = (replace(terms, branches=branches) for branches in range(MOST_BRANCHES + 1))
    return tuple(each for each in choices if len(each.parameters) <= most_parameters)
