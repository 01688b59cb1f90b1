"""Solver of a coupled system's macro step: Gauss-Seidel sweeps, iterated until inputs and outputs agree at its end.

The tear variables, outputs that a sweep uses before it computes them, are extrapolated to the end of the step. Then
each instance in turn steps over ``[t, t + h]`` on inputs that run from their values at ``t`` to those last known at
``t + h`` (value and derivative at both ends and at the midpoint, a Hermite polynomial), and its outputs are read
there. While the error exceeds the convergence tolerance, all instances roll back and step again. Converged, the step is
symmetric in time: the coupling neither creates nor dissipates energy.

Source: Kuebler and Schiehlen (2000), Mathematical and Computer Modelling of Dynamical Systems 6(2), 93-113, on
iterated coupling; the polynomial through value and derivative at both ends is the Hermite form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fmus.component import ComponentError
from .connected_instance import ConnectedInstance, DependencyLevel, connect_instance, connect_level
from .connections import WiringError
from .convergence import ConvergenceCriterion, InterpolationErrorEstimate
from .coupling_graph import CouplingGraph
from .coupling_state import Checkpoint, CouplingState
from .extrapolation import DerivativeEstimator, ExtrapolationHistory, Extrapolator, restart_history
from .quasi_newton import QuasiNewtonHistory
from .run_statistics import RunStatistics
from .zero_order_hold import ZeroOrderHold

Array = NDArray[np.float64]

MAX_INITIAL_SWEEPS, INITIAL_VALUE_TOLERANCE = 20, 1e-12
ROUNDING_RTOL = 1e-13
# Relative to nominal values: a larger error after all iterations is no mere rounding.
DIVERGENCE_THRESHOLD = 1e-3


@dataclass(frozen=True)
class SolverOptions:
    """Options of the iteration within a macro step.

    ``tolerance`` is the convergence tolerance, relative to the nominal values of the connected outputs; an error below
    ``interpolation_error_share`` of the interpolation error at mid-step is enough as well, see
    :class:`ConvergenceCriterion`. ``max_iterations`` bounds the iterations of a step, each a rollback and a new sweep,
    accelerated by :class:`QuasiNewton`.
    """

    tolerance: float = 1e-10
    max_iterations: int = 8
    interpolation_error_share: float = 0.06


DEFAULT_OPTIONS = SolverOptions()


class CouplingSolver:
    """Solver that steps the instances of a ``graph``, and the ``state`` that it changes.

    What iterations have learned of the coupling is kept over rollbacks and is no part of the state. ``inputs`` is the
    array that holds the values of all inputs, one for each of ``graph.input_ports``; a watchdog process may see it.
    """

    def __init__(
        self, graph: CouplingGraph, options: SolverOptions = DEFAULT_OPTIONS, inputs: Array | None = None
    ) -> None:
        self.graph = graph
        self._zero_order_hold = ZeroOrderHold(graph.components, graph.output_ports)
        self.state = _initial_state(graph, self._zero_order_hold, inputs)
        instances = {
            layout.component.name: connect_instance(layout, self.state.outputs, self.state.inputs)
            for layout in graph.instances
        }
        self._instances = tuple(instances.values())
        self._levels = tuple(connect_level(level, instances) for level in graph.dependency_levels)
        self._discontinuous_instances = tuple(instances[name] for name in graph.discontinuous_part.instances)
        self._discontinuous_levels = tuple(connect_level(level, instances) for level in graph.discontinuous_part.levels)
        self._port_indices = graph.port_indices
        self._tear_indices = graph.tearing.indices
        self._tear_nominals = graph.nominals[self._tear_indices]
        self._tear_readers = tuple(instances[name] for name in graph.tearing.readers)
        self._derivative_estimator = DerivativeEstimator(
            self._port_indices.differentiated_outputs, self._port_indices.derivatives
        )
        self._extrapolator = Extrapolator(graph.tearing.chains, self._tear_indices, self._tear_nominals)
        self._max_iterations = options.max_iterations if graph.supports_rollback else 0
        self._convergence = ConvergenceCriterion(
            InterpolationErrorEstimate(graph.tearing.chains, graph.nominals),
            options.tolerance,
            options.interpolation_error_share,
        )
        self._quasi_newton_history = QuasiNewtonHistory(len(self._tear_indices))

    @property
    def statistics(self) -> RunStatistics:
        """The statistics of all steps up to now."""
        return self.state.statistics

    def event_indicators(self) -> Array:
        """The event indicators, as last read."""
        values: Array = self.state.outputs[self._port_indices.event_indicators]
        return values

    def solve_initial_values(self, time: float, external_values: Array) -> None:
        """Solve for consistent initial values at ``time``: propagate outputs to inputs until none changes."""
        outputs = self.state.outputs
        self._set_external_inputs(external_values)
        for _ in range(MAX_INITIAL_SWEEPS):
            previous_outputs = outputs.copy()
            self._propagate(time, self._instances, self._levels)
            if np.allclose(
                outputs, previous_outputs, rtol=INITIAL_VALUE_TOLERANCE, atol=INITIAL_VALUE_TOLERANCE, equal_nan=True
            ):
                break
        else:
            raise WiringError(f"outputs at {time:g} s do not converge: they form an algebraic loop")
        for instance in self._instances:
            instance.read_outputs()
        self.reset_history(time)

    def reset_history(self, time: float) -> None:
        """Drop all history before ``time``, which is now: some output is not smooth there."""
        self._quasi_newton_history.reset()
        self._convergence.reset()
        self.state.extrapolation_history = restart_history(time, self.state.outputs)

    def _set_external_inputs(self, values: Array) -> None:
        self.state.inputs[self._port_indices.external_inputs] = values
        self.state.external_values = values

    def _propagate(
        self, time: float, instances: Sequence[ConnectedInstance], dependency_levels: Sequence[DependencyLevel] = ()
    ) -> None:
        outputs = self.state.outputs
        for instance in instances:
            instance.write_inputs(time, outputs)
        for level in dependency_levels:
            level.propagate(time, outputs)

    def step(self, time: float, step: float, start: Array, end: Array) -> None:
        """One macro step under external inputs that are ``start`` at its beginning and ``end`` at its end."""
        checkpoint = self.attempt_step(time, step, start, end)
        if checkpoint is not None:
            self.release(checkpoint)
        self.update_inputs()

    def attempt_step(self, time: float, step: float, start: Array, end: Array) -> Checkpoint | None:
        """A step as :meth:`step` makes it; returns its checkpoint, to be released, or None without rollback.

        Where an FMU fails recoverably, all of them are rolled back when ComponentError is raised.
        """
        self._apply_jumps(time, start)
        checkpoint = self.save() if self.graph.supports_rollback else None
        try:
            iterations, converged = self._iterate(time, step, end, checkpoint)
        except BaseException as error:
            if checkpoint is not None:
                if isinstance(error, ComponentError) and error.is_recoverable:
                    self.restore(checkpoint)
                self.release(checkpoint)
            raise
        self._record_statistics(step, iterations, converged)
        state = self.state
        state.pending_input_time = time + step
        if not converged:
            self.update_inputs()
        self._zero_order_hold.end_step(state.outputs)
        state.extrapolation_history = self._extrapolator.end_step(
            state.extrapolation_history, time + step, state.outputs
        )
        return checkpoint

    def _apply_jumps(self, time: float, external_values: Array) -> None:
        """Propagate external inputs and discrete outputs that have jumped since the last step."""
        state = self.state
        jumped = not (np.abs(external_values - state.external_values) <= ROUNDING_RTOL * np.abs(external_values)).all()
        held_values = self._zero_order_hold.sample(state.outputs)
        jumped |= not np.array_equal(held_values, state.held_values)
        state.held_values = held_values
        if jumped:
            self._set_external_inputs(external_values)
            self._propagate(time, self._discontinuous_instances, self._discontinuous_levels)

    def update_inputs(self) -> None:
        """Update the inputs that the last step took from extrapolated or iterated tear variables.

        In a converged step that changes outputs by no more than the convergence tolerance: it waits until they are
        read.
        """
        if self.state.pending_input_time is not None:
            self._propagate(self.state.pending_input_time, self._tear_readers)
            self.state.pending_input_time = None

    def _iterate(self, time: float, step: float, end: Array, checkpoint: Checkpoint | None) -> tuple[int, bool]:
        """Sweep until the tear variables converge; returns the number of iterations, and whether they have."""
        state = self.state
        outputs = state.outputs
        inputs_at_start, outputs_at_start = state.inputs.copy(), outputs.copy()
        quasi_newton = self._quasi_newton_history.for_step_size(step)
        quasi_newton.begin_step()
        state.extrapolation_history = self._extrapolator.begin_step(state.extrapolation_history, time + step, outputs)
        self._derivative_estimator.begin_step(state.extrapolation_history.past, time + step)
        self._set_external_inputs(end)
        tear_values = outputs[self._tear_indices] / self._tear_nominals
        quasi_newton.update(tear_values, self._sweep(time, step, inputs_at_start))
        iterations, state.diverged = 0, False
        while self._convergence.is_unconverged(
            error := quasi_newton.error_estimate(),
            outputs_at_start,
            outputs,
            step,
            is_last_iteration=iterations == self._max_iterations,
        ):
            if checkpoint is None or iterations == self._max_iterations:
                state.diverged = iterations > 0 and not error < DIVERGENCE_THRESHOLD
                return iterations, False
            tear_values = quasi_newton.next_input()
            outputs[self._tear_indices] = tear_values * self._tear_nominals
            self._restore_fmu_states(checkpoint)
            iterations += 1
            quasi_newton.update(tear_values, self._sweep(time, step, inputs_at_start))
        return iterations, True

    def _sweep(self, time: float, step: float, inputs_at_start: Array) -> Array:
        """One Gauss-Seidel sweep, each instance in turn; returns the tear variables relative to nominal values."""
        state = self.state
        outputs, held_values = state.outputs, state.held_values
        state.statistics.sweeps += 1
        self._derivative_estimator.fill(outputs)
        self._zero_order_hold.apply(outputs, held_values)
        for instance in self._instances:
            instance.do_step(time, step, inputs_at_start, outputs)
            self._derivative_estimator.fill(outputs)
            self._zero_order_hold.apply(outputs, held_values)
        tear_values: Array = outputs[self._tear_indices] / self._tear_nominals
        return tear_values

    def _record_statistics(self, step: float, iterations: int, converged: bool) -> None:
        indices, outputs, inputs = self._port_indices, self.state.outputs, self.state.inputs
        self.state.statistics.add_step(
            step,
            iterations,
            converged,
            (outputs[indices.effort_outputs], outputs[indices.flow_outputs]),
            (inputs[indices.effort_inputs], inputs[indices.flow_inputs]),
        )
        if self._derivative_estimator.count:
            self.state.statistics.add_derivative_errors(self._derivative_estimator.error_estimates(outputs))

    def record_estimated_error(self, error: float) -> None:
        """Record the estimated error (m) of an accepted step."""
        self.state.statistics.add_estimated_error(error)

    def save(self) -> Checkpoint:
        """Save a checkpoint; it has to be released with :meth:`release`."""
        return Checkpoint(tuple(instance.component.save() for instance in self._instances), self.state.copy())

    def restore(self, checkpoint: Checkpoint) -> None:
        """Roll back to a checkpoint."""
        self._restore_fmu_states(checkpoint)
        self.state.restore(checkpoint.state)

    def release(self, checkpoint: Checkpoint) -> None:
        """Free the FMU states of a checkpoint."""
        for instance, fmu_state in zip(self._instances, checkpoint.fmu_states, strict=True):
            instance.component.release(fmu_state)

    def _restore_fmu_states(self, checkpoint: Checkpoint) -> None:
        for instance, fmu_state in zip(self._instances, checkpoint.fmu_states, strict=True):
            instance.component.restore(fmu_state)


def _initial_state(graph: CouplingGraph, zero_order_hold: ZeroOrderHold, inputs: Array | None) -> CouplingState:
    """The state before initial values are solved for."""
    fallbacks = graph.fallbacks
    return CouplingState(
        outputs=np.zeros(len(graph.output_ports) + len(graph.port_indices.derivatives)),
        inputs=np.zeros(len(graph.input_ports)) if inputs is None else inputs,
        external_values=np.full(len(graph.external_inputs), np.nan),
        held_values=zero_order_hold.initial_values(),
        statistics=RunStatistics(
            fallbacks=fallbacks, squared_derivative_errors=np.zeros(len(fallbacks.estimated_derivatives))
        ),
        extrapolation_history=ExtrapolationHistory(()),
    )
