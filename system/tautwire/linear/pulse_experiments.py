"""Pulse-response experiments on a system of black-box FMUs at rest.

Each pulse holds one input slightly above its value at rest for one step, followed by a free response; then the same
below. Half the difference is the linear response: terms that are even in the amplitude cancel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cosimulation import CouplingGraph, CouplingSolver, Port, SolverOptions
from ..errors import TautwireError
from ..fmus.variable_units import nominal_of
from ..process_signals import defer_interrupts

Array = NDArray[np.float64]
CouplingFactory = Callable[[], AbstractContextManager[CouplingGraph]]

FREE_STEPS = 16
# The coupling converges to rounding: its residual is noise on small responses.
SOLVER_OPTIONS = SolverOptions(tolerance=1e-13, max_iterations=20, interpolation_error_share=0.0)
INITIAL_AMPLITUDE, MAX_AMPLITUDE, MIN_AMPLITUDE = 1e-2, 1e-1, 1e-7
# Even part of a response relative to the odd one: between these both rounding and nonlinearity are small.
MAX_NONLINEARITY, MIN_NONLINEARITY, MAX_AMPLITUDE_ROUNDS = 3e-4, 1e-8, 4
NONSMOOTH_NOTE_LEVEL, NONSMOOTH_ERROR_LEVEL = 1e-2, 1e-1
MAX_ERROR_ORDER, SUBSTEPS = 4, 8
DRIFT_NOTE_LEVEL, DRIFT_ERROR_LEVEL = 1e-2, 10.0
# Relative to a variable's nominal value or value at rest: smaller deviations count as none.
NEGLIGIBLE_DEVIATION = 1e-10
MIN_RELATIVE_RESPONSE = 1e-6


class IdentificationError(TautwireError):
    """A wired system of FMUs cannot be linearised from outside; carries the ``reason`` and a ``hint``."""

    def __init__(self, reason: str, hint: str) -> None:
        self.reason = reason
        self.hint = hint
        super().__init__(f"the FMUs cannot be linearised: {reason}; {hint}")


@dataclass(frozen=True)
class Responses:
    """Responses to m pulses of one step (s), observed at p ports.

    ``pulse_response`` (m, p) at the end of the pulse, ``free_response`` (N, m, p) after 1 ... N further steps, both
    for ``amplitudes`` (m,) of the inputs. ``scales`` (p,) are the largest deviations, or the negligible ones; in these
    units ``nonlinearity`` (m,) is the even part of each response relative to the odd one, and ``drifts`` (p,) is the
    motion without a pulse.
    """

    step: float
    pulse_response: Array
    free_response: Array
    scales: Array
    amplitudes: Array
    nonlinearity: Array
    drifts: Array


class PulseExperiment:
    """Pulse experiments on a system of FMUs at rest; each starts from the same saved state, or from a restart.

    They restart where an FMU cannot save its state, or takes steps of one length only: that may differ by experiment.

    Created by :func:`pulse_experiment`. ``rest_inputs`` (k,) are the coupling's external inputs at rest, ``inputs``
    those of them that get pulses, ``observed_ports`` the ports that are read, each with its ``negligible`` deviation.
    ``order`` is the order of the discretisation error in the step, or a lower bound of it.
    """

    def __init__(
        self,
        stack: ExitStack,
        make_coupling: CouplingFactory,
        rest_inputs: Mapping[Port, float],
        inputs: Sequence[Port],
        observed_ports: Sequence[Port],
    ) -> None:
        self._raise_interrupt = stack.enter_context(defer_interrupts())
        self._make_coupling = make_coupling
        self._rest_inputs = dict(rest_inputs)
        self.inputs, self.observed_ports = tuple(inputs), tuple(observed_ports)
        self._coupling = self._start_coupling(stack)
        self._rest_snapshot = self._coupling.save() if self._coupling.graph.supports_variable_step else None
        if self._rest_snapshot is not None:
            stack.callback(self._coupling.release, self._rest_snapshot)
        self._takes_whole_steps = (
            self._coupling.graph.supports_rollback and not self._coupling.graph.fallbacks.estimated_derivatives
        )
        self.order = min(self._coupling.graph.convergence_order, MAX_ERROR_ORDER) if self._takes_whole_steps else 1
        rest_values = self._rest_values(self._coupling)[self._input_indices(self._coupling)]
        self.nominal = np.maximum(self._nominal_values(inputs), np.abs(rest_values))
        self.negligible = NEGLIGIBLE_DEVIATION * np.maximum(
            self._nominal_values(observed_ports), np.abs(self._read_outputs(self._coupling))
        )

    def _start_coupling(self, stack: ExitStack) -> CouplingSolver:
        graph = stack.enter_context(self._make_coupling())
        missing = [str(port) for port in self.inputs if port not in graph.external_inputs]
        if missing:
            raise IdentificationError(
                f"{', '.join(missing)} is not an external input", "choose among the coupling's external inputs"
            )
        coupling = CouplingSolver(graph, SOLVER_OPTIONS)
        coupling.solve_initial_values(0.0, self._rest_values(coupling))
        for component in graph.components.values():
            component.run()
        return coupling

    def _nominal_values(self, ports: Sequence[Port]) -> Array:
        variables = [self._coupling.graph.components[port.component].variables[port.variable] for port in ports]
        return np.array([nominal_of(variable) for variable in variables])

    def _rest_values(self, coupling: CouplingSolver) -> Array:
        return np.array([self._rest_inputs.get(port, 0.0) for port in coupling.graph.external_inputs])

    def _input_indices(self, coupling: CouplingSolver) -> list[int]:
        return [coupling.graph.external_inputs.index(port) for port in self.inputs]

    @contextmanager
    def _at_rest(self) -> Iterator[CouplingSolver]:
        if self._rest_snapshot is not None:
            self._coupling.restore(self._rest_snapshot)
            yield self._coupling
            return
        with ExitStack() as stack:
            yield self._start_coupling(stack)

    def run_pulse(self, index: int | None, amplitude: float, step: float, free_steps: int) -> Array:
        """Observations at the end of the pulse and after each free step, (1 + free_steps, p); None: no pulse.

        A coupling that extrapolates from its history takes several substeps, and clears its history before each step:
        so the result of a step depends on the FMUs alone.
        """
        self._raise_interrupt()
        substeps = 1 if self._takes_whole_steps else SUBSTEPS
        with self._at_rest() as coupling:
            rest_values = self._rest_values(coupling)
            pulse_values = rest_values.copy()
            if index is not None:
                pulse_values[self._input_indices(coupling)[index]] += amplitude
            rows = np.empty((1 + free_steps, len(self.observed_ports)))
            for k in range(1 + free_steps):
                external_inputs = rest_values if k else pulse_values
                if not self._takes_whole_steps:
                    coupling.reset_history(k * step)
                for substep in range(substeps):
                    coupling.step((k + substep / substeps) * step, step / substeps, external_inputs, external_inputs)
                rows[k] = self._read_outputs(coupling)
            return rows

    def _read_outputs(self, coupling: CouplingSolver) -> Array:
        row = np.empty(len(self.observed_ports))
        for name in dict.fromkeys(port.component for port in self.observed_ports):
            indices = [index for index, port in enumerate(self.observed_ports) if port.component == name]
            component = coupling.graph.components[name]
            block = component.block([self.observed_ports[index].variable for index in indices])
            component.read(block)
            if not np.all(np.isfinite(block.values)):
                component.raise_not_finite(block)
            row[indices] = block.values
        return row


@contextmanager
def pulse_experiment(
    make_coupling: CouplingFactory,
    rest_inputs: Mapping[Port, float],
    inputs: Sequence[Port],
    observed_ports: Sequence[Port],
) -> Iterator[PulseExperiment]:
    """Context of a pulse experiment, which is released when the block ends."""
    with ExitStack() as stack:
        yield PulseExperiment(stack, make_coupling, rest_inputs, inputs, observed_ports)


def measure_responses(
    experiment: PulseExperiment, step: float, amplitudes: Array | None = None, free_steps: int = FREE_STEPS
) -> Responses:
    """Responses to a pulse on each input, with amplitudes at which neither rounding nor nonlinearity matters.

    ``amplitudes`` (m,) are a first guess. Raises IdentificationError where the system is not at rest, or not smooth.
    """
    amplitudes = INITIAL_AMPLITUDE * experiment.nominal if amplitudes is None else amplitudes.copy()
    unforced = experiment.run_pulse(None, 0.0, step, free_steps)
    odd = np.zeros((len(amplitudes), *unforced.shape))
    even = np.zeros((len(amplitudes), unforced.shape[1]))
    pending = np.ones(len(amplitudes), dtype=bool)
    for _ in range(MAX_AMPLITUDE_ROUNDS):
        for index in np.flatnonzero(pending):
            above = experiment.run_pulse(int(index), amplitudes[index], step, free_steps)
            below = experiment.run_pulse(int(index), -amplitudes[index], step, free_steps)
            odd[index] = 0.5 * (above - below)
            even[index] = np.max(np.abs(0.5 * (above + below) - unforced), axis=0)
        scales = np.maximum(np.max(np.abs(odd), axis=(0, 1)), experiment.negligible)
        relative_responses = np.max(np.abs(odd) / scales, axis=(1, 2), initial=0.0)
        nonlinearity = np.max(even / scales, axis=1, initial=0.0) / np.maximum(
            relative_responses, MIN_RELATIVE_RESPONSE
        )
        improved = _improved_amplitudes(experiment, amplitudes, nonlinearity)
        pending = improved != amplitudes
        if not np.any(pending):
            break
        previous, amplitudes = amplitudes, improved
    else:
        amplitudes = previous
    _require_smooth(experiment, nonlinearity)
    drifts = _relative_drifts(experiment, unforced, scales)
    return Responses(step, odd[:, 0], odd[:, 1:].transpose(1, 0, 2), scales, amplitudes, nonlinearity, drifts)


def _improved_amplitudes(experiment: PulseExperiment, amplitudes: Array, nonlinearity: Array) -> Array:
    """Amplitudes that aim at a nonlinearity of the geometric mean of its bounds; unchanged where within the bounds."""
    target = np.sqrt(MAX_NONLINEARITY * MIN_NONLINEARITY)
    factor = np.clip(target / np.maximum(nonlinearity, 1e-300), 1e-2, 1e2)
    factor[(nonlinearity <= MAX_NONLINEARITY) & (nonlinearity >= MIN_NONLINEARITY)] = 1.0
    improved = np.clip(amplitudes * factor, MIN_AMPLITUDE * experiment.nominal, MAX_AMPLITUDE * experiment.nominal)
    # At the bound already, or so near that another run does not pay.
    return np.where(np.abs(improved / amplitudes - 1.0) < 0.5, amplitudes, improved)


def _require_smooth(experiment: PulseExperiment, nonlinearity: Array) -> None:
    worst = int(np.argmax(nonlinearity))
    if nonlinearity[worst] > NONSMOOTH_ERROR_LEVEL:
        raise IdentificationError(
            f"nonsmooth at rest: responses to pulses of {experiment.inputs[worst]} up and down differ by "
            f"{nonlinearity[worst]:.0%}, however small",
            "start them where no cable is about to become slack and nothing is about to slip; if they are stiff, begin "
            "with a shorter step",
        )


def _relative_drifts(experiment: PulseExperiment, unforced: Array, scales: Array) -> Array:
    """Motion of each port without a pulse, relative to ``scales``."""
    drift_sizes = np.max(np.abs(unforced - unforced[0]), axis=0)
    drifts: Array = drift_sizes / scales
    worst = int(np.argmax(drifts))
    if drifts[worst] > DRIFT_ERROR_LEVEL:
        raise IdentificationError(
            f"they are not at rest, {experiment.observed_ports[worst]} moves by {drift_sizes[worst]:.3g} without "
            "a push",
            "start them in equilibrium, and give the external inputs' values there",
        )
    return drifts
