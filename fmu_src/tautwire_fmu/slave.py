"""The base of all slaves: time-stamped inputs, complete saved states, one list of numbers.

Inputs carry their own rates. A master that knows nothing of this sets inputs at the start of a step, and the slave
extrapolates them over it. A master that also sets ``input_time`` says when they hold: stamped with the end of the
step, the inputs run on a polynomial from those set before to those set now; with ``middle_time``, through those of
the middle.
"""

import json
import math
from operator import itemgetter
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple
from xml.etree.ElementTree import Element

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.enums import Fmi2Status

from .description import Variable, complete
from .past import Pieces

Snapshot = Tuple[Tuple[float, ...], Optional[Tuple[float, ...]], float, bool, Tuple[Pieces, ...]]

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


class AllInputs(NamedTuple):
    """References that were last set; ``in_order`` sorts their values where they are all inputs, else None."""

    references: Sequence[int]
    in_order: Optional[Callable[[Sequence[float]], Tuple[float, ...]]]


class Slave(Fmi2Slave):
    """A slave whose variables are the entries of one list, in the order of their value references.

    Subclasses give ``variables`` and where the ``states`` are, and implement :meth:`advance` and :meth:`refresh`.
    Inputs come first in the list, ``input_time`` at their head.
    """

    author = "Tautwire"
    license = "MIT"

    def __init__(self, data: Dict[str, Any], variables: Sequence[Variable], states: slice, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.modelName = data["model_name"]
        self.description = data["description"]
        self.guid = data["guid"]
        self.states = states
        self.variables = tuple(variables)
        self.real: List[float] = [variable.start for variable in self.variables]
        self.input_count = sum(variable.causality == "input" for variable in self.variables)
        self.first_parameter = next(i for i, variable in enumerate(self.variables) if variable.causality == "parameter")
        self.middle_place = next((i for i, v in enumerate(self.variables) if v.name == MIDDLE_TIME.name), None)
        self.middle_given = False
        self.earlier: Optional[Tuple[float, ...]] = None
        self.all_inputs = AllInputs((), None)
        self.elapsed = 0.0
        self.time = 0.0
        self.pasts: Tuple[Pieces, ...] = ()
        self.started = False
        self.stale = True
        # Whether nothing was set since the last step.
        self.untouched = False
        self.fault = ""
        for variable in self.variables:
            self.register_variable(_fmi_variable(variable, self), nested=False)

    def parameters_changed(self) -> None:
        """Take over parameters from ``self.real``; before the first step the start state follows them."""

    def advance(self, step: float, ends: bool) -> None:
        """Integrate over one step; ``ends`` tells that the inputs hold at its end, else at its start."""
        raise NotImplementedError

    def refresh(self) -> None:
        """Bring the outputs in ``self.real`` up to date with state and inputs."""
        raise NotImplementedError

    def get_real(self, vrs: Sequence[int]) -> List[float]:
        if self.stale:
            self._refresh_or_nan()
            self.stale = False
        try:
            return [self.real[reference] for reference in vrs]
        except IndexError:
            return [self.real[r] if r < len(self.real) else self._unknown(r) for r in vrs]

    def set_real(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        if not vrs:
            return
        real = self.real
        if vrs != self.all_inputs.references:
            self.all_inputs = _all_inputs(vrs, self.input_count)
        if self.all_inputs.in_order is not None:
            given = self.all_inputs.in_order(values)
            if given[0] != real[0]:
                self.earlier = tuple(real[: self.input_count])
            real[: self.input_count] = given
        else:
            self._set_some(vrs, values)
        self.stale = True
        self.untouched = False
        self.elapsed = 0.0

    def _set_some(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        real, highest = self.real, max(vrs)
        if 0 in vrs and values[vrs.index(0)] != real[0]:
            self.earlier = tuple(real[: self.input_count])
        if highest >= len(real):
            vrs, values = self._known(vrs, values)
        for reference, value in zip(vrs, values):
            real[reference] = value
        if highest >= self.first_parameter:
            self.parameters_changed()

    def do_step(self, current_time: float, step_size: float) -> bool:
        if not (step_size > 0.0 and math.isfinite(current_time) and math.isfinite(step_size)):
            self.tell(f"step of {step_size!r} s at {current_time!r} s: must be positive", Fmi2Status.error)
            return False
        if self.fault:
            self.tell(self.fault, Fmi2Status.error)
            return False
        before = self.snapshot()
        ends = self.earlier is not None and self.real[0] > current_time + 0.5 * step_size
        self.middle_given = ends and self._holds_in_middle(current_time, step_size)
        self.time = current_time
        try:
            self.advance(step_size, ends)
            if not all(map(math.isfinite, self.real[self.states])):
                raise ValueError("the state is not finite any more")
        except (ArithmeticError, ValueError) as error:
            self.restore(before)
            told = f"step of {step_size!r} s at {current_time!r} s: {error}; inputs {self.inputs_by_name()}"
            self.tell(told, Fmi2Status.error)
            return False
        self.started = True
        self.elapsed = 0.0 if ends else step_size
        self.stale = self.untouched = True
        return True

    def _holds_in_middle(self, time: float, step: float) -> bool:
        return self.middle_place is not None and abs(self.real[self.middle_place] - time - 0.5 * step) < 1e-3 * step

    def _refresh_or_nan(self) -> None:
        """Refresh outputs; where the law has no value for the inputs, all outputs become NaN.

        An exception must not leave a slave: pythonfmu 0.7.0 ends the process at the third.
        """
        try:
            self.refresh()
        except (ArithmeticError, ValueError) as error:
            for reference, variable in enumerate(self.variables):
                if variable.causality == "output" and not self._is_state(reference):
                    self.real[reference] = math.nan
            self.tell(f"no outputs: {error}; inputs {self.inputs_by_name()}", Fmi2Status.warning)

    def _is_state(self, reference: int) -> bool:
        return self.states.start <= reference < self.states.stop

    def _known(self, vrs: Sequence[int], values: Sequence[float]) -> Tuple[Sequence[int], Sequence[float]]:
        for reference in vrs:
            if reference >= len(self.real):
                self._unknown(reference)
        known = [place for place, reference in enumerate(vrs) if reference < len(self.real)]
        return [vrs[place] for place in known], [values[place] for place in known]

    def _unknown(self, reference: int) -> float:
        self.fault = f"no real variable has the value reference {reference}"
        self.tell(self.fault, Fmi2Status.error)
        return math.nan

    def tell(self, message: str, status: Fmi2Status) -> None:
        """Log; the wrapper hands the text to the host as a format, where a percent sign would be an order."""
        self.log(message.replace("%", " per cent"), status)

    def inputs_by_name(self) -> Dict[str, float]:
        """The inputs as they were set."""
        return {v.name: value for v, value in zip(self.variables, self.real[: self.input_count])}

    def snapshot(self) -> Snapshot:
        """All that the slave remembers."""
        return (tuple(self.real), self.earlier, self.elapsed, self.started, self.pasts)

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot; a redo from it gives the same bits."""
        real, self.earlier, self.elapsed, self.started, self.pasts = snapshot
        parameters = self.real[self.first_parameter :]
        self.real = list(real)
        self.stale = True
        self.untouched = False
        if parameters != self.real[self.first_parameter :]:
            self.parameters_changed()

    def _get_fmu_state(self) -> Snapshot:
        return self.snapshot()

    def _set_fmu_state(self, state: Optional[Snapshot]) -> None:
        if state is None or len(state[0]) != len(self.real):
            self.fault = "a saved state that was no state of this FMU"
            self.tell(self.fault, Fmi2Status.error)
            return
        self.fault = ""
        self.restore(state)

    @staticmethod
    def _fmu_state_to_bytes(state: Snapshot) -> bytes:
        return json.dumps(state).encode("utf-8")

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> Optional[Snapshot]:
        try:
            real, earlier, elapsed, started, pasts = json.loads(state.decode("utf-8"))
            before = None if earlier is None else tuple(map(float, earlier))
            pieces = tuple(tuple(tuple(map(float, piece)) for piece in past) for past in pasts)
            return (tuple(map(float, real)), before, float(elapsed), bool(started), pieces)
        except (ValueError, TypeError):
            return None

    def to_xml(self, model_options: Dict[str, str] = {}) -> Element:  # noqa: B006 (pythonfmu's signature)
        return complete(super().to_xml(model_options), self.variables)


def _all_inputs(references: Sequence[int], count: int) -> AllInputs:
    """Inputs come first, with the lowest references."""
    order = sorted(range(len(references)), key=references.__getitem__)
    whole = count > 1 and [references[place] for place in order] == list(range(count))
    return AllInputs(list(references), itemgetter(*order) if whole else None)


def read_resource(resources: str, name: str) -> Dict[str, Any]:
    """The data that make this FMU this component."""
    data: Dict[str, Any] = json.loads((Path(resources) / name).read_text(encoding="utf-8"))
    return data


def _fmi_variable(variable: Variable, owner: Slave) -> Real:
    reference = len(owner.vars)
    parameter = variable.causality == "parameter"
    given = parameter or variable.causality == "input"
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
        initial=Fmi2Initial.exact if parameter else None if given else Fmi2Initial.calculated,
        description=variable.description,
        getter=lambda: owner.real[reference],
    )
