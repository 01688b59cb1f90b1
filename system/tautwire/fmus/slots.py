"""The slots of a robot that an FMU of the user's can take, and what such an FMU must show there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import fmpy
from fmpy.model_description import ModelDescription, ScalarVariable

from tautwire_fmu.units import UNITS

from ..errors import InputError, shown
from ..master import Port
from ..master.archive import ArchiveError, description_of
from ..master.component import INSTANCES
from ..master.seat import STAMP
from ..master.standard import is_real, kind_of
from ..master.units import measure, measure_of, same_unit, unit_of
from ..robots.robot import OwnFmu, Robot, slots

AXES = ("x", "y", "z")
LONGEST_REASON = 200
EXPORT = "export it as FMI 2.0 or 3.0 co-simulation"


@dataclass(frozen=True)
class SlotPort:
    """A variable, Real or Float64, that the FMU in a slot has, or may have; ``causality`` as FMI names it."""

    name: str
    causality: str
    unit: str
    required: bool


class SlotError(InputError):
    """A user's FMU does not fit its slot; ``port`` is the variable in question, None where it is the whole FMU."""

    def __init__(self, path: Path, slot: str, port: str | None, problem: str, mend: str) -> None:
        super().__init__(str(path), f"cannot be the FMU {slot}: {problem}", mend)
        self.path = path
        self.slot = slot
        self.port = port
        self.args = (path, slot, port, problem, mend)


def slot_ports(slot: str, cable_count: int) -> tuple[SlotPort, ...]:
    """All ports that connect the component in a slot with the others, and those that a run records."""
    kind = slot.partition("_")[0]
    if kind == "platform":
        numbers = range(1, cable_count + 1)
        return (
            *_vector("position", "output", "m"),
            *_vector("velocity", "output", "m/s"),
            *_vector("acceleration", "output", "m/s2", False),
            *(port for i in numbers for port in _vector(f"force_{i}", "input", "N")),
            *(port for i in numbers for port in _vector(f"force_rate_{i}", "input", "N/s", False)),
            *_motion("output"),
            *(port for i in numbers for port in _vector(f"middle_force_{i}", "input", "N", False)),
            *(port for i in numbers for port in _vector(f"middle_force_rate_{i}", "input", "N/s", False)),
        )
    if kind == "cable":
        return (
            *_vector("position", "input", "m"),
            *_vector("velocity", "input", "m/s"),
            *_vector("acceleration", "input", "m/s2", False),
            SlotPort("winch_speed", "input", "m/s", True),
            SlotPort("winch_acceleration", "input", "m/s2", False),
            *_vector("force", "output", "N"),
            *_vector("force_rate", "output", "N/s", False),
            SlotPort("tension", "output", "N", False),
            SlotPort("pull", "output", "N", False),
            *(SlotPort(name, "output", "m", False) for name in ("length", "elongation")),
            SlotPort("strain", "output", "1", False),
            *_motion("input"),
            *_vector("middle_force", "output", "N", False),
            *_vector("middle_force_rate", "output", "N/s", False),
        )
    return (
        SlotPort("speed_command", "input", "m/s", True),
        SlotPort("speed_command_rate", "input", "m/s2", False),
        SlotPort("winch_speed", "output", "m/s", True),
        SlotPort("winch_acceleration", "output", "m/s2", False),
        SlotPort("command_margin", "output", "m/s", False),
        SlotPort("acceleration_margin", "output", "m/s2", False),
        SlotPort("speed_margin", "output", "m/s", False),
    )


def _vector(name: str, causality: str, unit: str, required: bool = True) -> tuple[SlotPort, ...]:
    return tuple(SlotPort(f"{name}.{axis}", causality, unit, required) for axis in AXES)


def _motion(causality: str) -> tuple[SlotPort, ...]:
    """The platform's motion in the middle of a step."""
    return (
        *_vector("middle_position", causality, "m", False),
        *_vector("middle_velocity", causality, "m/s", False),
        *_vector("middle_acceleration", causality, "m/s2", False),
    )


def lacking_ports(own: Mapping[str, Path], cable_count: int) -> frozenset[Port]:
    """The ports of the robot's wiring that FMUs of the user's, by slot, do not have; raises SlotError for no FMU.

    Rates of inputs go with input_time: without it an FMU gets inputs to hold over a step, not to extrapolate.
    """
    lacking = set()
    for slot, path in own.items():
        there = {variable.name for variable in _description(OwnFmu(slot, path)).modelVariables}
        for port in slot_ports(slot, cable_count):
            rate = port.causality == "input" and not port.required
            if port.name not in there or (rate and STAMP not in there):
                lacking.add(Port(slot, port.name))
    return frozenset(lacking)


def unstated_units(fmus: Iterable[OwnFmu], cable_count: int) -> tuple[str, ...]:
    """What to tell of FMUs whose ports state no units."""
    notes = []
    for own in fmus:
        variables = {variable.name: variable for variable in _description(own).modelVariables}
        bare = [port for port in slot_ports(own.slot, cable_count) if port.name in variables]
        bare = [port for port in bare if unit_of(variables[port.name]) is None]
        if bare:
            first = f"{bare[0].name} for {bare[0].unit}"
            notes.append(f"{own.path}: {len(bare)} ports state no unit and are taken for ours, such as {first}")
    return tuple(notes)


def require_steps(own: Mapping[str, Path], chosen: bool, even: bool) -> None:
    """Refuse FMUs of the user's, by slot, that cannot make the steps of a run; raises SlotError.

    Steps are ``chosen`` by a tolerance or fixed, and of one length if ``even``.
    """
    for slot, path in own.items():
        able = _description(OwnFmu(slot, path)).coSimulation
        if chosen and not able.canGetAndSetFMUstate:
            problem = "it cannot save its state, so steps cannot be chosen by a tolerance"
            raise SlotError(path, slot, None, problem, "give a step instead, such as --step 0.001")
        if not (even or able.canHandleVariableCommunicationStepSize):
            problem = "it takes steps of one length only, these are not"
            raise SlotError(path, slot, None, problem, "give evenly spaced samples, and a step instead of a tolerance")


def own_fmus(given: list[str], cable_count: int) -> tuple[OwnFmu, ...]:
    """FMUs that a command line gives as ``SLOT=FILE``; raises InputError where one is not of that form."""
    found: dict[str, OwnFmu] = {}
    for text in given:
        slot, equals, name = text.partition("=")
        known = slots(cable_count)
        mend = (
            f"give a slot and a file, as in --fmu platform=mine.fmu; slots are {known[0]}, {known[1]} ... {known[-1]}"
        )
        if not equals or not name.strip() or slot not in known:
            raise InputError("--fmu", f"{shown(text)} names no slot of this robot and file", mend)
        if slot in found:
            raise InputError("--fmu", f"{slot} is given twice", "give it once")
        found[slot] = OwnFmu(slot, Path(name))
    return tuple(found.values())


def check_own_fmus(robot: Robot) -> None:
    """Refuse a user's FMU that does not fit its slot; raises SlotError."""
    single: dict[Path, str] = {}
    for own in robot.fmus:
        description = _description(own, whole=True)
        if description.coSimulation.canBeInstantiatedOnlyOncePerProcess:
            taken = single.setdefault(own.path.resolve(), own.slot)
            if taken != own.slot:
                problem = f"it is in slot {taken} and can be instantiated only once"
                raise SlotError(own.path, own.slot, None, problem, "copy nothing, export it without that restriction")
        variables = {variable.name: variable for variable in description.modelVariables}
        for port in slot_ports(own.slot, robot.cable_count):
            _check_port(own, description, variables.get(port.name), port)


def _description(own: OwnFmu, whole: bool = False) -> ModelDescription:
    """What the FMU says of itself, if it is one that can run here; read through as a ``whole`` if asked to."""

    def refusal(problem: str, mend: str) -> SlotError:
        return SlotError(own.path, own.slot, None, problem, mend)

    if not own.path.is_file():
        raise refusal("there is no such file", "check the path")
    try:
        description = description_of(own.path, whole)
        platforms = fmpy.supported_platforms(str(own.path))
    except ArchiveError as error:
        raise refusal(f"it {error.problem}", error.mend) from error
    # fmpy raises whatever the archive, the parser or its own checks do, plain Exception among them.
    except Exception as error:
        reason = shown(" ".join(str(error).split()), LONGEST_REASON)
        raise refusal(f"it cannot be read as an FMU ({reason})", "name an FMI 2.0 or 3.0 co-simulation FMU") from error
    if description.fmiVersion not in INSTANCES:
        raise refusal(f"it is FMI {description.fmiVersion}", EXPORT)
    if description.coSimulation is None:
        kind = "scheduled execution" if description.modelExchange is None else "model exchange"
        raise refusal(f"it is for {kind} only", EXPORT)
    if fmpy.platform not in platforms:
        runs = ", ".join(platforms) or "no platform"
        raise refusal(f"it has binaries for {runs}, none for {fmpy.platform}", f"export it for {fmpy.platform}")
    return description


def _check_port(own: OwnFmu, description: ModelDescription, variable: ScalarVariable | None, port: SlotPort) -> None:
    expected = f"a {INSTANCES[description.fmiVersion].real} {port.causality} in {port.unit}"

    def refusal(problem: str, mend: str) -> SlotError:
        return SlotError(own.path, own.slot, port.name, f"{port.name} {problem}", mend)

    if variable is None:
        if port.required:
            raise refusal("is missing", f"give it a variable {port.name}, {expected}")
        return
    if not is_real(variable) or variable.causality != port.causality:
        raise refusal(f"is a {kind_of(variable)} {variable.causality}", f"make it {expected}")
    unit = unit_of(variable)
    stated = (unit, None if unit is None else measure(description, unit))
    if not same_unit(stated, (port.unit, measure_of(UNITS[port.unit]))):
        raise refusal(f"is in {unit!r}", f"make it {expected}")
