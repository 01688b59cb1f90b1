"""Base class of all FMI slaves: time-stamped inputs, complete saved states, one list of variable values.

Inputs come with their rates. A master that knows nothing of this sets inputs at the start of a step, and the slave
extrapolates them over it. A master that also sets ``input_time`` states when they hold: with the time of the end of the
step, the inputs are interpolated by a polynomial from those set before to those set now; with ``middle_time``, through
those of the middle.
"""

import ctypes
import json
import math
from operator import itemgetter
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, NoReturn, Optional, Sequence, Tuple
from xml.etree.ElementTree import Element

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.default_experiment import DefaultExperiment
from pythonfmu.enums import Fmi2Status

from .delay_line import DelayLine
from .dormand_prince import RELATIVE_TOLERANCE
from .model_description import Variable, bound_problem, complete_model_description

Snapshot = Tuple[Tuple[float, ...], Optional[Tuple[float, ...]], float, bool, Tuple[DelayLine, ...]]

INPUT_TIME = Variable(
    "input_time",
    "input",
    "s",
    "time at which the inputs hold, set before or together with them; at or before the start of a step they are "
    "extrapolated over it",
)
MIDDLE_TIME = Variable(
    "middle_time",
    "input",
    "s",
    "time at which the inputs of the middle hold; they count in a step of which it is the middle",
)
# s: a plain fixed-step master errs by micrometres at this step on a robot of tens of metres.
DEFAULT_STEP_SIZE = 1e-3
DEFAULT_STOP_TIME = 10.0


class CachedReferences(NamedTuple):
    """Value references that were last set; ``sort_values`` sorts their values where they are all inputs, else None."""

    references: Sequence[int]
    sort_values: Optional[Callable[[Sequence[float]], Tuple[float, ...]]]


class Slave(Fmi2Slave):
    """Co-simulation slave whose variables are the entries of one list, in the order of their value references.

    Subclasses pass ``variables`` and the slice of the ``states``, and implement :meth:`advance` and :meth:`refresh`.
    Inputs come first in the list, ``input_time`` at their head.
    """

    author = "Tautwire"
    license = "MIT"

    def __init__(self, data: Dict[str, Any], variables: Sequence[Variable], states: slice, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.modelName = data["model_name"]
        self.description = data["description"]
        self.guid = data["guid"]
        self.version = data["version"]
        self.default_experiment = DefaultExperiment(
            start_time=0.0,
            stop_time=DEFAULT_STOP_TIME,
            step_size=data.get("period", DEFAULT_STEP_SIZE),
            tolerance=RELATIVE_TOLERANCE,
        )
        self.states = states
        self.variables = tuple(variables)
        self.real: List[float] = [variable.start for variable in self.variables]
        self.input_count = sum(variable.causality == "input" for variable in self.variables)
        self.first_parameter = next(i for i, variable in enumerate(self.variables) if variable.causality == "parameter")
        self.middle_time_index = next((i for i, v in enumerate(self.variables) if v.name == MIDDLE_TIME.name), None)
        self.has_middle_inputs = False
        self.previous_inputs: Optional[Tuple[float, ...]] = None
        self.cached_references = CachedReferences((), None)
        self.elapsed = 0.0
        self.time = 0.0
        self.delay_lines: Tuple[DelayLine, ...] = ()
        self.started = False
        self.outputs_stale = True
        # Whether no variable was set since the last step.
        self.inputs_unchanged = False
        self.fault = ""
        for variable in self.variables:
            self.register_variable(_fmi_variable(variable, self), nested=False)

    def parameters_changed(self) -> None:
        """Read the parameters from ``self.real``; before the first step the start state follows them."""

    def advance(self, step: float, inputs_at_end: bool) -> None:
        """Integrate over one step; the inputs hold at its end if ``inputs_at_end``, else at its start."""
        raise NotImplementedError

    def refresh(self) -> None:
        """Compute the outputs in ``self.real`` from state and inputs."""
        raise NotImplementedError

    def get_real(self, vrs: Sequence[int]) -> List[float]:
        if self.outputs_stale:
            self._refresh_or_nan()
            self.outputs_stale = False
        try:
            return [self.real[reference] for reference in vrs]
        except IndexError:
            return [self.real[r] if r < len(self.real) else self._report_unknown_reference(r) for r in vrs]

    def set_real(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        if not vrs:
            return
        real = self.real
        if vrs != self.cached_references.references:
            self.cached_references = _cache_references(vrs, self.input_count)
        if self.cached_references.sort_values is not None:
            input_values = self.cached_references.sort_values(values)
            if input_values[0] != real[0]:
                self.previous_inputs = tuple(real[: self.input_count])
            real[: self.input_count] = input_values
            self.elapsed = 0.0
        else:
            self._set_selected(vrs, values)
        self.outputs_stale = True
        self.inputs_unchanged = False

    def _set_selected(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        real, highest = self.real, max(vrs)
        if highest >= self.first_parameter:
            self._require_parameters_within_bounds(vrs, values)
        if 0 in vrs and values[vrs.index(0)] != real[0]:
            self.previous_inputs = tuple(real[: self.input_count])
        if highest >= len(real):
            vrs, values = self._select_known(vrs, values)
        for reference, value in zip(vrs, values):
            real[reference] = value
            if reference < self.input_count:
                self.elapsed = 0.0
        if highest >= self.first_parameter:
            self.parameters_changed()

    def exit_initialization_mode(self) -> None:
        self._require_finite_inputs(self.time)

    def do_step(self, current_time: float, step_size: float) -> bool:
        if not (step_size > 0.0 and math.isfinite(current_time) and math.isfinite(step_size)):
            self.log_message(f"step of {step_size!r} s at {current_time!r} s: must be positive", Fmi2Status.error)
            return False
        if self.fault:
            self.log_message(self.fault, Fmi2Status.error)
            return False
        if not math.isfinite(sum(self.real[: self.input_count])):
            self._require_finite_inputs(current_time)
        state_before = self.snapshot()
        inputs_at_end = self.previous_inputs is not None and self.real[0] > current_time + 0.5 * step_size
        self.has_middle_inputs = inputs_at_end and self._middle_inputs_hold(current_time, step_size)
        self.time = current_time
        try:
            self.advance(step_size, inputs_at_end)
            if not all(map(math.isfinite, self.real[self.states])):
                raise ValueError("the state is not finite any more")
        except (ArithmeticError, ValueError) as error:
            self.restore(state_before)
            message = f"step of {step_size!r} s at {current_time!r} s: {error}; inputs {self.inputs_by_name()}"
            self.log_message(message, Fmi2Status.error)
            return False
        self.started = True
        self.elapsed = 0.0 if inputs_at_end else step_size
        self.outputs_stale = self.inputs_unchanged = True
        return True

    def _require_parameters_within_bounds(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        for reference, value in zip(vrs, values):
            if self.first_parameter <= reference < len(self.real):
                problem = bound_problem(self.variables[reference], value)
                if problem:
                    self._raise_to_importer(problem)

    def _require_finite_inputs(self, time: float) -> None:
        infinite = [f"{name} is {value!r}" for name, value in self.inputs_by_name().items() if not math.isfinite(value)]
        if infinite:
            self._raise_to_importer(f"at {time!r} s {', '.join(infinite)}: inputs have to be finite")

    def _raise_to_importer(self, message: str) -> NoReturn:
        """End the call with the status fatal and this message.

        After a discarded step fmpy ends a run as if all were well, and pythonfmu 0.7.0 has no other status. It gives up
        three references at an exception, and the same again as it frees the instance, so they are taken here.
        """
        for owned in (self, type(self), self.log_queue):
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(owned))
        raise ValueError(message.replace("%", " per cent"))

    def _middle_inputs_hold(self, time: float, step: float) -> bool:
        return (
            self.middle_time_index is not None
            and abs(self.real[self.middle_time_index] - time - 0.5 * step) < 1e-3 * step
        )

    def _refresh_or_nan(self) -> None:
        """Compute the outputs; where the law has no value for the inputs, all that depend on them become NaN.

        An exception would end the run, while an importer may try such inputs in passing.
        """
        try:
            self.refresh()
        except (ArithmeticError, ValueError) as error:
            for reference, variable in enumerate(self.variables):
                # Values in the middle of the last step depend on no inputs of now.
                is_of_last_step = self.started and variable.name.startswith("middle_")
                if variable.causality == "output" and not self._is_state(reference) and not is_of_last_step:
                    self.real[reference] = math.nan
            self.log_message(f"no outputs: {error}; inputs {self.inputs_by_name()}", Fmi2Status.warning)

    def _is_state(self, reference: int) -> bool:
        return self.states.start <= reference < self.states.stop

    def _select_known(self, vrs: Sequence[int], values: Sequence[float]) -> Tuple[Sequence[int], Sequence[float]]:
        for reference in vrs:
            if reference >= len(self.real):
                self._report_unknown_reference(reference)
        known_indices = [index for index, reference in enumerate(vrs) if reference < len(self.real)]
        return [vrs[index] for index in known_indices], [values[index] for index in known_indices]

    def _report_unknown_reference(self, reference: int) -> float:
        self.fault = f"no real variable has the value reference {reference}"
        self.log_message(self.fault, Fmi2Status.error)
        return math.nan

    def log_message(self, message: str, status: Fmi2Status) -> None:
        """Log a message without percent signs: the wrapper passes the text to the host as a printf format."""
        self.log(message.replace("%", " per cent"), status)

    def inputs_by_name(self) -> Dict[str, float]:
        """Inputs by variable name, as they were set."""
        return {v.name: value for v, value in zip(self.variables, self.real[: self.input_count])}

    def snapshot(self) -> Snapshot:
        """Complete state of the slave: variables, earlier inputs, time since them, and delay lines."""
        return (tuple(self.real), self.previous_inputs, self.elapsed, self.started, self.delay_lines)

    def restore(self, snapshot: Snapshot) -> None:
        """Roll back to a snapshot; a step repeated from it gives the same bits."""
        real, self.previous_inputs, self.elapsed, self.started, self.delay_lines = snapshot
        parameters = self.real[self.first_parameter :]
        self.real = list(real)
        self.outputs_stale = True
        self.inputs_unchanged = False
        if parameters != self.real[self.first_parameter :]:
            self.parameters_changed()

    def _get_fmu_state(self) -> Snapshot:
        return self.snapshot()

    def _set_fmu_state(self, state: Optional[Snapshot]) -> None:
        if state is None or len(state[0]) != len(self.real):
            self.fault = "a saved state that was no state of this FMU"
            self.log_message(self.fault, Fmi2Status.error)
            return
        self.fault = ""
        self.restore(state)

    @staticmethod
    def _fmu_state_to_bytes(state: Snapshot) -> bytes:
        return json.dumps(state).encode("utf-8")

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> Optional[Snapshot]:
        try:
            real, previous, elapsed, started, delay_line_lists = json.loads(state.decode("utf-8"))
            previous_inputs = None if previous is None else tuple(map(float, previous))
            delay_lines = tuple(tuple(tuple(map(float, piece)) for piece in past) for past in delay_line_lists)
            return (tuple(map(float, real)), previous_inputs, float(elapsed), bool(started), delay_lines)
        except (ValueError, TypeError):
            return None

    def to_xml(self, model_options: Dict[str, str] = {}) -> Element:  # noqa: B006 (pythonfmu's signature)
        root = super().to_xml(model_options)
        root.set("generationTool", f"Tautwire {self.version}")
        return complete_model_description(root, self.variables)


def _cache_references(references: Sequence[int], count: int) -> CachedReferences:
    """Whether and how a list of references covers all inputs, which have the lowest references."""
    order = sorted(range(len(references)), key=references.__getitem__)
    covers_all_inputs = count > 1 and [references[index] for index in order] == list(range(count))
    return CachedReferences(list(references), itemgetter(*order) if covers_all_inputs else None)


def read_resource(resources: str, name: str) -> Dict[str, Any]:
    """Read the JSON resource that parametrises this FMU."""
    data: Dict[str, Any] = json.loads((Path(resources) / name).read_text(encoding="utf-8"))
    return data


def _fmi_variable(variable: Variable, owner: Slave) -> Real:
    reference = len(owner.vars)
    parameter = variable.causality == "parameter"
    is_set_from_outside = parameter or variable.causality == "input"
    return Real(
        variable.name,
        causality=Fmi2Causality[variable.causality],
        variability=(
            (Fmi2Variability.tunable if variable.tunable else Fmi2Variability.fixed)
            if parameter
            else Fmi2Variability.discrete
            if variable.discrete
            else Fmi2Variability.continuous
        ),
        initial=Fmi2Initial.exact if parameter else None if is_set_from_outside else Fmi2Initial.calculated,
        description=variable.description,
        getter=lambda: owner.real[reference],
    )
