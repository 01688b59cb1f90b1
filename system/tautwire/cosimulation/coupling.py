"""One macro step of a coupled system by Gauss-Seidel sweeps, iterated until inputs and outputs agree at its end.

The tear variables, outputs that a sweep uses before it computes them, are extrapolated to the end of the step. Then
each instance in turn steps over ``[t, t + h]`` on inputs that run from their values at ``t`` to those last known at
``t + h`` (value and derivative at both ends and at the midpoint, a Hermite polynomial), and its outputs are read
there. While the error exceeds the tolerance, all instances roll back and step again. Converged, the step is symmetric
in time: the coupling neither creates nor dissipates energy.

Source: Kuebler and Schiehlen (2000), Mathematical and Computer Modelling of Dynamical Systems 6(2), 93-113, on
iterated coupling; the polynomial through value and derivative at both ends is the Hermite form.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..fmus.component import Component, ComponentError
from ..fmus.variable_units import nominal_of
from .connections import (
    Connection,
    Port,
    WiringError,
    check_connections,
    check_derivative_connections,
    dependency_groups,
)
from .convergence import ConvergenceCriterion, InterpolationErrorEstimate
from .execution_order import (
    INPUT_TIME,
    MIDDLE_TIME,
    ConnectedInstance,
    DependencyLevel,
    Indices,
    affected_connections,
    convergence_order_of,
    gauss_seidel_order,
    takes_middle_inputs,
    tear_variables,
)
from .extrapolation import DerivativeEstimator, ExtrapolationHistory, Extrapolator
from .hermite_interpolation import derivative_chains
from .quasi_newton import QuasiNewton, QuasiNewtonHistory
from .run_statistics import PowerBond, RunStatistics, find_fallbacks
from .zero_order_hold import ZeroOrderHold

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Checkpoint:
    """The state of a coupling at a communication point, for a rollback to it."""

    fmu_states: tuple[ctypes.c_void_p, ...]
    outputs: Array
    inputs: Array
    external_values: Array
    statistics: RunStatistics
    extrapolation_history: ExtrapolationHistory


MAX_INITIAL_SWEEPS, INITIAL_VALUE_TOLERANCE = 20, 1e-12
ROUNDING_RTOL = 1e-13
# Relative to nominal values: a larger error after all iterations is no mere rounding.
DIVERGENCE_THRESHOLD = 1e-3


class Coupling:
    """A coupled system of FMU instances: the connection graph, its state, and the solver of a macro step.

    ``external_inputs`` are the input ports that the master itself sets; ``power_bonds`` are audited for energy;
    ``event_indicators`` are outputs whose zero crossings are state events, see :func:`step_with_events`. ``tolerance``
    is relative to the nominal values of the connected outputs; with an ``interpolation_error_share``, an error below
    that share of the interpolation error is enough, see :class:`ConvergenceCriterion`. ``max_iterations`` bounds the
    iterations of a step, each a rollback and a new sweep, accelerated by :class:`QuasiNewton`. ``supports_rollback``
    is False where some FMU cannot save its state, ``supports_variable_step`` also where some FMU takes no variable
    step: then no step is iterated, or split at events. ``convergence_order`` is that of the error in the step size.
    ``derivative_connections`` are pairs whose target takes the time derivative of the source, estimated from past
    communication points, see :class:`DerivativeEstimator`. ``allocate_inputs`` returns the array that holds the values
    of all inputs, so that a watchdog process may see them.
    """

    def __init__(
        self,
        components: Mapping[str, Component],
        connections: Sequence[Connection],
        external_inputs: Sequence[Port],
        power_bonds: Sequence[PowerBond] = (),
        event_indicators: Sequence[Port] = (),
        tolerance: float = 1e-10,
        max_iterations: int = 8,
        allocate_inputs: Callable[[Sequence[Port]], Array] | None = None,
        derivative_connections: Sequence[Connection] = (),
    ) -> None:
        check_connections(components, connections)
        check_derivative_connections(components, derivative_connections)
        self.components = dict(components)
        self.external_inputs = tuple(external_inputs)
        self.tolerance = tolerance
        self.max_iterations = max_iterations
        self.interpolation_error_share = 0.0
        self.supports_rollback = all(c.supports_rollback for c in components.values())
        self.supports_variable_step = self.supports_rollback and all(
            c.supports_variable_step for c in components.values()
        )
        fallbacks = find_fallbacks(components, connections, external_inputs, derivative_connections)
        self.statistics = RunStatistics(
            fallbacks=fallbacks, squared_derivative_errors=np.zeros(len(fallbacks.estimated_derivatives))
        )
        names = list(components)
        connected_outputs = {wire.source for wire in (*connections, *derivative_connections)}
        output_ports = sorted(connected_outputs | set(event_indicators), key=lambda p: (names.index(p.component), p))
        differentiated_ports = list(dict.fromkeys(pair.source for pair in derivative_connections))
        # Estimated derivatives follow all outputs, as outputs of a component without a name.
        all_output_ports = [*output_ports, *map(_derivative_port, differentiated_ports)]
        all_connections = [
            *connections,
            *(Connection(_derivative_port(pair.source), pair.target) for pair in derivative_connections),
        ]
        self._outputs = np.zeros(len(all_output_ports))
        self._derivative_estimator = DerivativeEstimator(
            _indices_of(output_ports, differentiated_ports), np.arange(len(output_ports), len(all_output_ports))
        )
        self._nominals = np.array([nominal_of(components[p.component].variables[p.variable]) for p in output_ports])
        input_ports = [port for name in names for port in self._input_ports(name, all_connections)]
        self._inputs = np.zeros(len(input_ports)) if allocate_inputs is None else allocate_inputs(input_ports)
        self._instances = {
            name: self._connected_instance(name, all_connections, all_output_ports, input_ports) for name in names
        }
        self._execution_order = [
            self._instances[name] for name in gauss_seidel_order(components, connections, output_ports)
        ]
        self._external_indices = _indices_of(input_ports, external_inputs)
        groups = dependency_groups(components, connections)
        self._dependency_levels = [self._dependency_level(group, output_ports) for group in groups]
        self._zero_order_hold = ZeroOrderHold(components, output_ports)
        discontinuous_inputs = [*external_inputs, *self._zero_order_hold.targets(connections)]
        self._discontinuous_instances = [
            self._instances[name] for name in dict.fromkeys(port.component for port in discontinuous_inputs)
        ]
        self._discontinuous_levels = [
            self._dependency_level(group, output_ports)
            for group in affected_connections(components, groups, discontinuous_inputs)
        ]
        efforts, flows = [bond.effort for bond in power_bonds], [bond.flow for bond in power_bonds]
        self._bond_output_indices = (
            _indices_of(output_ports, [c.source for c in efforts]),
            _indices_of(output_ports, [c.source for c in flows]),
        )
        self._bond_input_indices = (
            _indices_of(input_ports, [c.target for c in efforts]),
            _indices_of(input_ports, [c.target for c in flows]),
        )
        self._event_indices = _indices_of(output_ports, event_indicators)
        self._external_values = np.full(len(external_inputs), np.nan)
        self._pending_input_time: float | None = None
        self.diverged = False
        self._tear_indices = tear_variables(
            [seat.component.name for seat in self._execution_order],
            (*connections, *derivative_connections),
            output_ports,
        )
        self._tear_nominals = self._nominals[self._tear_indices]
        self._tear_readers = [
            seat for seat in self._execution_order if np.isin(seat.source_indices, self._tear_indices).any()
        ]
        chains = derivative_chains(components, output_ports, set(self._tear_indices.tolist()))
        self._extrapolator = Extrapolator(chains, self._tear_indices, self._tear_nominals)
        self._convergence = ConvergenceCriterion(InterpolationErrorEstimate(chains, self._nominals))
        self.convergence_order = convergence_order_of(self._execution_order, all_connections)
        self._quasi_newton_history = QuasiNewtonHistory(len(self._tear_indices))
        self._quasi_newton = QuasiNewton(len(self._tear_indices))

    def _input_ports(self, name: str, connections: Sequence[Connection]) -> list[Port]:
        component = self.components[name]
        time_inputs = [Port(name, INPUT_TIME)] * (INPUT_TIME in component.variables)
        time_inputs += [Port(name, MIDDLE_TIME)] * takes_middle_inputs(component, connections)
        external_inputs = [port for port in self.external_inputs if port.component == name]
        return [*time_inputs, *external_inputs, *(c.target for c in connections if c.target.component == name)]

    def _connected_instance(
        self, name: str, connections: Sequence[Connection], output_ports: Sequence[Port], input_ports: Sequence[Port]
    ) -> ConnectedInstance:
        component = self.components[name]
        output_indices = [place for place, port in enumerate(output_ports) if port.component == name]
        input_indices = [place for place, port in enumerate(input_ports) if port.component == name]
        output_slice, input_slice = slice(*_slice_ends(output_indices)), slice(*_slice_ends(input_indices))
        sources = _indices_of(output_ports, [c.source for c in connections if c.target.component == name])
        return ConnectedInstance(
            component=component,
            outputs=component.block(
                [port.variable for port in output_ports[output_slice]], self._outputs[output_slice]
            ),
            inputs=component.block([port.variable for port in input_ports[input_slice]], self._inputs[input_slice]),
            input_slice=input_slice,
            source_indices=sources,
            connected_inputs=self._inputs[input_slice][len(input_indices) - len(sources) :],
            has_input_time=INPUT_TIME in component.variables,
            has_middle_time=takes_middle_inputs(component, connections),
        )

    def _dependency_level(self, group: Sequence[Connection], output_ports: Sequence[Port]) -> DependencyLevel:
        reads = []
        for name in dict.fromkeys(c.source.component for c in group):
            ports = list(dict.fromkeys(c.source for c in group if c.source.component == name))
            block = self.components[name].block([port.variable for port in ports])
            reads.append((self.components[name], block, _indices_of(output_ports, ports)))
        targets = dict.fromkeys(c.target.component for c in group)
        return DependencyLevel(tuple(reads), tuple(self._instances[name] for name in targets))

    def solve_initial_values(self, time: float, external_values: Array) -> None:
        """Solve for consistent initial values at ``time``: propagate outputs to inputs until none changes."""
        self._set_external_inputs(external_values)
        for _ in range(MAX_INITIAL_SWEEPS):
            previous_outputs = self._outputs.copy()
            self._propagate(time, self._execution_order, self._dependency_levels)
            if np.allclose(
                self._outputs,
                previous_outputs,
                rtol=INITIAL_VALUE_TOLERANCE,
                atol=INITIAL_VALUE_TOLERANCE,
                equal_nan=True,
            ):
                break
        else:
            raise WiringError(f"outputs at {time:g} s do not settle: they depend on each other without delay")
        for instance in self._execution_order:
            instance.read_outputs()
        self.reset_history(time)

    def reset_history(self, time: float) -> None:
        """Drop all history before ``time``, which is now: some output is not smooth there."""
        self._quasi_newton_history.reset()
        self._convergence.reset()
        self._extrapolator.reset(time, self._outputs)

    def event_indicators(self) -> Array:
        """The event indicators, as last read."""
        values: Array = self._outputs[self._event_indices]
        return values

    def _set_external_inputs(self, values: Array) -> None:
        self._inputs[self._external_indices] = values
        self._external_values = values

    def _propagate(
        self, time: float, instances: Sequence[ConnectedInstance], dependency_levels: Sequence[DependencyLevel] = ()
    ) -> None:
        for instance in instances:
            instance.write_inputs(time, self._outputs)
        for level in dependency_levels:
            level.propagate(time, self._outputs)

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
        jumped = not (np.abs(start - self._external_values) <= ROUNDING_RTOL * np.abs(start)).all()
        jumped |= self._zero_order_hold.begin_step(self._outputs)
        if jumped:
            self._set_external_inputs(start)
            self._propagate(time, self._discontinuous_instances, self._discontinuous_levels)
        checkpoint = self.save() if self.supports_rollback else None
        try:
            iterations, converged = self._iterate(time, step, end, checkpoint)
        except BaseException as error:
            if checkpoint is not None:
                if isinstance(error, ComponentError) and error.is_recoverable:
                    self.restore(checkpoint)
                self.release(checkpoint)
            raise
        self._record_statistics(step, iterations, converged)
        self.diverged = (
            not converged and iterations > 0 and not self._quasi_newton.error_estimate() < DIVERGENCE_THRESHOLD
        )
        self._pending_input_time = time + step
        if not converged:
            self.update_inputs()
        self._zero_order_hold.end_step(self._outputs)
        self._extrapolator.end_step(time + step, self._outputs)
        return checkpoint

    def update_inputs(self) -> None:
        """Update the inputs that the last step took from extrapolated or iterated tear variables.

        In a converged step that changes outputs by no more than the tolerance, so it waits until they are read.
        """
        if self._pending_input_time is not None:
            self._propagate(self._pending_input_time, self._tear_readers)
            self._pending_input_time = None

    def _iterate(self, time: float, step: float, end: Array, checkpoint: Checkpoint | None) -> tuple[int, bool]:
        """Sweep until the tear variables converge; returns the number of iterations, and whether they have."""
        inputs_at_start, outputs_at_start = self._inputs.copy(), self._outputs.copy()
        self._quasi_newton = self._quasi_newton_history.for_step_size(step)
        self._quasi_newton.begin_step()
        self._extrapolator.begin_step(time + step, self._outputs)
        self._derivative_estimator.begin_step(self._extrapolator.history.past, time + step)
        self._set_external_inputs(end)
        error = self._sweep(time, step, inputs_at_start, self._outputs[self._tear_indices] / self._tear_nominals)
        iterations = 0
        max_iterations = 0 if checkpoint is None else self.max_iterations
        while self._convergence.is_unconverged(
            error,
            self.tolerance,
            self.interpolation_error_share,
            outputs_at_start,
            self._outputs,
            step,
            is_last_iteration=iterations == max_iterations,
        ):
            if checkpoint is None or iterations == max_iterations:
                return iterations, False
            tear_values = self._quasi_newton.next_input()
            self._outputs[self._tear_indices] = tear_values * self._tear_nominals
            self._restore_fmu_states(checkpoint)
            iterations += 1
            error = self._sweep(time, step, inputs_at_start, tear_values)
        return iterations, True

    def _sweep(self, time: float, step: float, inputs_at_start: Array, tear_values: Array) -> float:
        """One Gauss-Seidel sweep, each instance in turn; returns the largest estimated error of the tear variables.

        The error and ``tear_values`` are relative to nominal values.
        """
        self.statistics.sweeps += 1
        self._derivative_estimator.fill(self._outputs)
        self._zero_order_hold.apply(self._outputs)
        for instance in self._execution_order:
            instance.do_step(time, step, inputs_at_start, self._outputs)
            self._derivative_estimator.fill(self._outputs)
            self._zero_order_hold.apply(self._outputs)
        new_tear_values = self._outputs[self._tear_indices] / self._tear_nominals
        self._quasi_newton.update(tear_values, new_tear_values)
        return self._quasi_newton.error_estimate()

    def _record_statistics(self, step: float, iterations: int, converged: bool) -> None:
        (effort_outputs, flow_outputs), (effort_inputs, flow_inputs) = (
            self._bond_output_indices,
            self._bond_input_indices,
        )
        self.statistics.add_step(
            step,
            iterations,
            converged,
            (self._outputs[effort_outputs], self._outputs[flow_outputs]),
            (self._inputs[effort_inputs], self._inputs[flow_inputs]),
        )
        if self._derivative_estimator.count:
            self.statistics.add_derivative_errors(self._derivative_estimator.error_estimates(self._outputs))

    def save(self) -> Checkpoint:
        """Save a checkpoint; it has to be released with :meth:`release`."""
        fmu_states = tuple(seat.component.save() for seat in self._execution_order)
        return Checkpoint(
            fmu_states,
            self._outputs.copy(),
            self._inputs.copy(),
            self._external_values,
            copy(self.statistics),
            self._extrapolator.history,
        )

    def restore(self, checkpoint: Checkpoint) -> None:
        """Roll back to a checkpoint."""
        self._restore_fmu_states(checkpoint)
        self._outputs[:] = checkpoint.outputs
        self._inputs[:] = checkpoint.inputs
        self._zero_order_hold.reset()
        self._external_values = checkpoint.external_values
        self.statistics = replace(checkpoint.statistics, sweeps=self.statistics.sweeps)
        self._pending_input_time = None
        self._extrapolator.history = checkpoint.extrapolation_history

    def release(self, checkpoint: Checkpoint) -> None:
        """Free the FMU states of a checkpoint."""
        for instance, state in zip(self._execution_order, checkpoint.fmu_states, strict=True):
            instance.component.release(state)

    def _restore_fmu_states(self, checkpoint: Checkpoint) -> None:
        for instance, state in zip(self._execution_order, checkpoint.fmu_states, strict=True):
            instance.component.restore(state)


def _derivative_port(port: Port) -> Port:
    return Port("", f"rate of {port}")


def _indices_of(among: Sequence[Port], ports: Sequence[Port]) -> Indices:
    return np.array([among.index(port) for port in ports], dtype=np.intp)


def _slice_ends(indices: Sequence[int]) -> tuple[int, int]:
    """Start and stop of the slice that covers consecutive indices."""
    return (indices[0], indices[-1] + 1) if indices else (0, 0)
