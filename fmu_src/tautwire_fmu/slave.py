"""The base of all slaves: time-stamped inputs, complete saved states, one list of numbers.

Inputs carry their own rates. A master that knows nothing of this sets inputs at the start of a step, and the slave
extrapolates them over it. A master that also sets ``input_time`` says when they hold: stamped with the end of the
step, the inputs run on a polynomial from those set before to those set now.
"""

import json
import math
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple
from xml.etree.ElementTree import Element

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.enums import Fmi2Status

from .description import Variable, complete
from .laws.effects import BY_NAME, ActiveEffect

Snapshot = Tuple[Tuple[float, ...], Optional[Tuple[float, ...]], float, bool]

INPUT_TIME = Variable(
    "input_time",
    "input",
    "s",
    "time at which the inputs hold; at or before the start of a step they are extrapolated over it",
)


class Slave(Fmi2Slave):
    """A slave whose variables are the entries of one list, in the order of their value references.

    Subclasses give ``variables`` and implement :meth:`advance` and :meth:`refresh`. Inputs come first in the list,
    ``input_time`` at their head.
    """

    author = "Tautwire"
    license = "MIT"

    def __init__(self, variables: Sequence[Variable], **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.variables = tuple(variables)
        self.real: List[float] = [variable.start for variable in self.variables]
        self.input_count = sum(variable.causality == "input" for variable in self.variables)
        self.first_parameter = next(i for i, variable in enumerate(self.variables) if variable.causality == "parameter")
        self.earlier: Optional[Tuple[float, ...]] = None
        self.elapsed = 0.0
        self.started = False
        self.stale = True
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
            self.attempt(self.refresh)
            self.stale = False
        real = self.real
        return [real[reference] for reference in vrs]

    def attempt(self, refresh: Callable[[], None]) -> None:
        """Refresh outputs; where the law has no value for the inputs, all outputs become NaN.

        An exception must not leave a slave: pythonfmu 0.7.0 ends the process at the third.
        """
        try:
            refresh()
        except (ArithmeticError, ValueError) as error:
            for reference, variable in enumerate(self.variables):
                if variable.causality == "output":
                    self.real[reference] = math.nan
            self.log(f"no outputs: {error}; inputs {self.inputs_by_name()}", Fmi2Status.warning)

    def inputs_by_name(self) -> Dict[str, float]:
        """The inputs as they were set."""
        return {v.name: value for v, value in zip(self.variables, self.real[: self.input_count])}

    def set_real(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        if not vrs:
            return
        real = self.real
        if 0 in vrs and values[list(vrs).index(0)] != real[0]:
            self.earlier = tuple(real[: self.input_count])
        for reference, value in zip(vrs, values):
            real[reference] = value
        self.stale = True
        self.elapsed = 0.0
        if max(vrs) >= self.first_parameter:
            self.parameters_changed()

    def do_step(self, current_time: float, step_size: float) -> bool:
        if not (step_size > 0.0 and math.isfinite(current_time) and math.isfinite(step_size)):
            self.log(f"step of {step_size!r} s at {current_time!r} s: must be positive", Fmi2Status.error)
            return False
        before = self.snapshot()
        ends = self.earlier is not None and self.real[0] > current_time + 0.5 * step_size
        try:
            self.advance(step_size, ends)
        except (ArithmeticError, ValueError) as error:
            self.restore(before)
            told = f"step of {step_size!r} s at {current_time!r} s: {error}; inputs {self.inputs_by_name()}"
            self.log(told, Fmi2Status.error)
            return False
        self.started = True
        self.elapsed = 0.0 if ends else step_size
        self.stale = True
        return True

    def snapshot(self) -> Snapshot:
        """All that the slave remembers."""
        return (tuple(self.real), self.earlier, self.elapsed, self.started)

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot; a redo from it gives the same bits."""
        real, self.earlier, self.elapsed, self.started = snapshot
        parameters = self.real[self.first_parameter :]
        self.real = list(real)
        self.stale = True
        if parameters != self.real[self.first_parameter :]:
            self.parameters_changed()

    def _get_fmu_state(self) -> Snapshot:
        return self.snapshot()

    def _set_fmu_state(self, state: Snapshot) -> None:
        self.restore(state)

    @staticmethod
    def _fmu_state_to_bytes(state: Snapshot) -> bytes:
        return json.dumps(state).encode("utf-8")

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> Snapshot:
        real, earlier, elapsed, started = json.loads(state.decode("utf-8"))
        return (tuple(real), None if earlier is None else tuple(earlier), elapsed, started)

    def to_xml(self, model_options: Dict[str, str] = {}) -> Element:  # noqa: B006 (pythonfmu's signature)
        return complete(super().to_xml(model_options), self.variables)


def read_resource(resources: str, name: str) -> Dict[str, Any]:
    """The data that make this FMU this component."""
    data: Dict[str, Any] = json.loads((Path(resources) / name).read_text(encoding="utf-8"))
    return data


def effect_variables(settings: Sequence[Dict[str, Any]]) -> Tuple[Variable, ...]:
    """A tunable parameter for every number of every effect that is switched on."""
    return tuple(
        Variable(
            f"effect.{setting['name']}.{parameter.name}",
            "parameter",
            parameter.unit,
            parameter.description,
            start=float(setting["values"][parameter.name]),
            tunable=True,
            minimum=parameter.minimum,
            maximum=parameter.maximum,
        )
        for setting in settings
        for parameter in BY_NAME[setting["name"]].parameters
    )


def active_effects(settings: Sequence[Dict[str, Any]], numbers: Sequence[float]) -> Tuple[ActiveEffect, ...]:
    """The effects that are switched on, with the present values of their parameters."""
    active = []
    rest = list(numbers)
    for setting in settings:
        effect = BY_NAME[setting["name"]]
        count = len(effect.parameters)
        active.append(ActiveEffect(effect, effect.values(*rest[:count])))
        rest = rest[count:]
    return tuple(active)


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
            else Fmi2Variability.continuous
        ),
        initial=Fmi2Initial.exact if parameter else None if given else Fmi2Initial.calculated,
        description=variable.description,
        getter=lambda: owner.real[reference],
    )
