"""Result of a trace: values only, for reports to show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..cosimulation.robot_cosimulation import CosimulationResult
from ..recordings.recording import Recording
from ..robot.schema import Robot
from .disturbance import Disturbance
from .localisation.component_residuals import FaultLocalisation

Array = NDArray[np.float64]
Verdict = Literal["effects", "none", "discovered", "unexplained"]


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval; ``declared`` is what the robot file says, where it says anything.

    ``dominant_uncertainty`` tells in words what accounts for most of the interval's width, where that is known.
    """

    value: float
    unit: str
    low: float
    high: float
    declared: float | None
    dominant_uncertainty: str = ""


@dataclass(frozen=True)
class FoundEffect:
    """An effect that was accepted; ``evidence`` is the natural log of its likelihood ratio on unseen data.

    ``share`` is the part of what was missed that it explains; ``unstable`` are names of parameters on which both
    recordings, each by itself, do not agree.
    """

    name: str
    component: str
    cables: tuple[int, ...]
    parameters: Mapping[str, Estimate]
    evidence: float
    share: float | None = None
    unstable: tuple[str, ...] = ()


@dataclass(frozen=True)
class FittedParameter:
    """Identifies a fitted parameter: effect, cables and parameter name."""

    name: str
    cables: tuple[int, ...]
    parameter: str


@dataclass(frozen=True)
class Correlation:
    """Correlation of the errors of two estimates, from -1 to 1."""

    between: tuple[FittedParameter, FittedParameter]
    value: float


@dataclass(frozen=True)
class Candidate:
    """A hypothesis that was tried: one effect more than the model had in its round.

    ``evidence`` is the natural log of its likelihood ratio on unseen data, against the model without it;
    ``mean_square`` the mean square of the whitened innovations there (one where the residual is white noise). A
    fit estimates the parameters of its ``form``; the others are neutral. ``required_evidence`` is what one more effect
    needs in that round, where that is known.
    """

    round: int
    name: str
    cables: tuple[int, ...]
    values: Mapping[str, float]
    evidence: float
    mean_square: float
    accepted: bool
    form: tuple[str, ...]
    required_evidence: float | None = None

    @property
    def form_values(self) -> Mapping[str, float]:
        """The values of the parameters that a fit estimates."""
        return {name: value for name, value in self.values.items() if name in self.form}


@dataclass(frozen=True)
class Errors:
    """Root mean squares of residuals: positions in m over each axis and all, tensions in N over each cable and all.

    NaN where nothing was measured; ``axes`` has shape (3,), ``cables`` (n,). Of a platform that turns also those of the
    rotations between measured and simulated orientation, in rad about each axis, ``rotations`` (3,), and about all.
    """

    position_rms: float
    tension_rms: float
    axes: Array
    cables: Array
    orientation_rms: float = float("nan")
    rotations: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def by_kind(self) -> tuple[float, float, float]:
        """Those of positions, tensions and rotations."""
        return self.position_rms, self.tension_rms, self.orientation_rms

    @property
    def by_output(self) -> Array:
        """Those of each output, (m,)."""
        return np.concatenate([self.axes, self.cables, self.rotations])


@dataclass(frozen=True)
class Comparison:
    """One recording beside the co-simulations of the robot before and after; ``role`` is "fit" or "check".

    ``innovations`` (N, m) are the whitened one-step prediction errors under the robot after, NaN where nothing was
    measured.
    """

    role: str
    recording: Recording
    before: CosimulationResult
    after: CosimulationResult
    errors_before: Errors
    errors_after: Errors
    innovations: Array | None = None


@dataclass(frozen=True)
class Detectable:
    """Detectable size of a parameter, from where the effect is absent: a recording shows it nine times out of ten.

    ``other_values`` are the values of the effect's other parameters that this holds for. Infinite where no size would
    show, or none that the parameter may have.
    """

    name: str
    cables: tuple[int, ...]
    parameter: str
    size: float
    unit: str
    other_values: Mapping[str, float]


@dataclass(frozen=True)
class ConfusableEffect:
    """Confusable effect: how much of an accepted effect another could mimic, by the ``cosine`` of their angle.

    It is 1 where all of it; ``nats`` is the evidence lost if the other replaced it, as far as linearisation holds.
    """

    name: str
    cables: tuple[int, ...]
    other: str
    other_cables: tuple[int, ...]
    cosine: float
    nats: float


@dataclass(frozen=True)
class Identifiability:
    """Identifiability: what one recording could have shown beside the accepted effects."""

    detectable: tuple[Detectable, ...] = ()
    confusable: tuple[ConfusableEffect, ...] = ()


@dataclass(frozen=True)
class Resonance:
    """A frequency (Hz) at which something swings, the outputs in which it shows, and the recordings it was seen on."""

    frequency: float
    outputs: tuple[str, ...]
    on: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """In words."""
        places = ", ".join(self.outputs)
        return f"an oscillation at {self.frequency:.2g} Hz that the model lacks is visible in {places}"


@dataclass(frozen=True)
class Trace:
    """Result of a trace: what the model lacks.

    ``correlations`` are those of each two parameters of the effects. ``noise_floor`` is what noise of the sensors and
    of the recorded winch speeds would leave; ``normalised_innovation_variance`` is the mean square of the whitened
    innovations of each output (x, y, z, tensions, rotations) under the final model on unseen data, shape (m,), 1 where
    the residual is white noise, and ``autocorrelations`` the largest correlation of each with itself, and what noise
    stays below, as :func:`residual_analysis.largest_autocorrelations` gives them. ``identifiability`` is what those
    data could have shown beside the effects; empty where the model leaves more than noise. ``components`` tells where
    the fit recording errs, before any effect is fitted. ``disturbance`` is what had to be assumed beside white noise.
    ``left_share`` is the part of what was missed that no effect explains, where effects were established or a
    disturbance assumed, and ``small_effects`` are those that explain too little to matter. ``untried`` are
    sentences on what there was no time for.
    """

    verdict: Verdict
    sentence: str
    robot_before: Robot
    robot_after: Robot
    effects: tuple[FoundEffect, ...]
    correlations: tuple[Correlation, ...]
    also_possible: tuple[tuple[str, ...], ...]
    candidates: tuple[Candidate, ...]
    formula: str | None
    comparisons: tuple[Comparison, ...]
    noise_floor: Errors
    noise_before: bool
    noise_after: bool
    normalised_innovation_variance: Array
    autocorrelations: tuple[Array, Array]
    identifiability: Identifiability
    components: FaultLocalisation
    resonances: tuple[Resonance, ...]
    alpha: float
    notes: tuple[str, ...]
    seconds: float
    disturbance: Disturbance | None = None
    left_share: float | None = None
    small_effects: tuple[FoundEffect, ...] = ()
    untried: tuple[str, ...] = ()
