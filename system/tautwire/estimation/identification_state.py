"""State of an identification: what its stages have found so far."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from ..cosimulation.robot_cosimulation import CosimulationResult
from ..robot.schema import Robot
from .cosimulation_validation import compare_cosimulations, is_near_noise_floor, start_cosimulations
from .discovery.formula_discovery import Discovery
from .discovery.unexplained_residual import UnexplainedResidual
from .explained_shares import ExplainedShares, sensor_noise_floor
from .identification_context import IdentificationContext
from .localisation.component_localisation import FaultLocalisation
from .parameter_fit import Fitter
from .preprocessing import PreparedData, all_residuals_white, innovations_of
from .selection_result import SelectionResult
from .smoothed_states import Calibration
from .trace_result import Comparison, Errors, FoundEffect, Identifiability, Verdict
from .worker_pool import PendingResult


@dataclass(frozen=True)
class Identification:
    """State of an identification: what its stages have found so far.

    ``corrected`` are the data to take where no effects explain those as recorded. ``final_robot`` is the best
    model that the FMUs confirm, with uncertain numbers as FIT has them, the declared one until then. ``effects_hold``
    tells whether the FMUs confirm the selection, ``discovery`` is a formula that they confirm. ``shares`` are there
    where a disturbance is a part of the model, and decide, or once effects of exact form are established;
    ``calibrations`` by recording where effects have intervals.
    """

    context: IdentificationContext
    prepared: PreparedData
    corrected: tuple[PreparedData, ...]
    selection: SelectionResult
    final_robot: Robot
    pending_runs: tuple[PendingResult[CosimulationResult], ...] = ()
    pending_localisation: tuple[PendingResult[FaultLocalisation], ...] = ()
    runs_before: tuple[CosimulationResult, ...] = ()
    comparisons: tuple[Comparison, ...] = ()
    noise_floors: tuple[Errors, ...] = ()
    effects_hold: bool = False
    discovery: Discovery | None = None
    unexplained: UnexplainedResidual = field(default_factory=UnexplainedResidual)
    verdict: tuple[Verdict, str] = ("unexplained", "")
    effects: tuple[FoundEffect, ...] = ()
    identifiability: Identifiability = field(default_factory=Identifiability)
    small_effects: tuple[FoundEffect, ...] = ()
    shares: ExplainedShares | None = None
    calibrations: tuple[Calibration, ...] = ()

    @property
    def is_white_before(self) -> bool:
        """Whether the declared model leaves white noise; beside a disturbance, whether its co-simulation does."""
        if self.context.fitter.has_disturbance:
            return bool(self.comparisons) and self._is_near_floor("errors_before")
        policy = self.context.policy.residual_analysis
        return all_residuals_white(self.prepared.innovations, self.prepared.split, policy)

    @property
    def is_white_after(self) -> bool:
        """Whether the identified model leaves white noise; beside a disturbance, whether its co-simulation does."""
        if self.context.fitter.has_disturbance:
            return bool(self.comparisons) and self._is_near_floor("errors_after")
        return self.effects_hold or self.discovery is not None or self.is_white_before

    def _is_near_floor(self, errors: str) -> bool:
        ratio = self.context.policy.cosimulation.max_error_ratio
        pairs = zip(self.comparisons, self.noise_floors, strict=True)
        return all(is_near_noise_floor(getattr(c, errors), floor, ratio) for c, floor in pairs)

    @property
    def selection_explains(self) -> bool:
        """Whether effects were selected that leave white noise; beside a disturbance any do."""
        if not self.selection.accepted or self.context.fitter.has_disturbance:
            return bool(self.selection.accepted)
        context, policy = self.context, self.context.policy.residual_analysis
        innovations = innovations_of(context.fitter, self.selection.fit.robot, context.split)
        return all_residuals_white(innovations, context.split, policy)


def with_final_robot(state: Identification, fitter: Fitter, robot: Robot) -> Identification:
    """The state with a robot as the final one, and what its co-simulations leave, near noise or not."""
    context, data_sets = state.context, state.prepared.data_sets
    runs = [run.result() for run in start_cosimulations(context.workers, fitter, robot, data_sets)]
    comparisons, _ = compare_cosimulations(robot, fitter, data_sets, state.runs_before, runs)
    floors = tuple(sensor_noise_floor(fitter, robot, data) for data in data_sets)
    return replace(state, final_robot=robot, comparisons=comparisons, noise_floors=floors)
