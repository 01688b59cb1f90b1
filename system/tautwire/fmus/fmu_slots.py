"""The slots of a robot that a user FMU can take, and the ports that it must have there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import fmpy
from fmpy.model_description import ModelDescription, ScalarVariable

from tautwire_fmu.units import UNITS

from ..errors import InputError, format_value
from ..robot.active_effects import attachment_settings, cable_settings, platform_settings, shifts_position
from ..robot.schema import AXES, Robot, UserFmu, fmu_slots
from .component import INSTANCE_TYPES
from .fmi_binding import is_real_scalar, type_name
from .fmu_archive import ArchiveError, read_model_description
from .fmu_variables import INPUT_TIME, Port
from .variable_units import definition_from_exponents, same_unit, unit_definition, unit_of

MAX_REASON_CHARACTERS = 200
EXPORT_HINT = "export it as FMI 2.0 or 3.0 co-simulation"


@dataclass(frozen=True)
class SlotPort:
    """Variable, Real or Float64, that the FMU in a slot must or may have; ``causality`` as in FMI."""

    name: str
    causality: str
    unit: str
    required: bool


class SlotError(InputError):
    """A user FMU does not fit its slot; ``port`` is the variable in question, None where it is the whole FMU."""

    def __init__(self, path: Path, slot: str, port: str | None, problem: str, hint: str) -> None:
        super().__init__(str(path), f"cannot be the FMU {slot}: {problem}", hint)
        self.path = path
        self.slot = slot
        self.port = port
        self.args = (path, slot, port, problem, hint)


def slot_ports(slot: str, cable_count: int, is_rigid: bool = False) -> tuple[SlotPort, ...]:
    """Ports that connect the component in a slot with the others, and those that a run records.

    A platform that ``is_rigid`` has those of each attachment.
    """
    kind = slot.partition("_")[0]
    if kind == "platform":
        numbers = range(1, cable_count + 1)
        motion = _rigid_motion_ports(numbers) if is_rigid else _motion_ports("output", "")
        return (*motion, *_platform_inputs(numbers))
    return _cable_ports() if kind == "cable" else _winch_ports()


def _rigid_motion_ports(numbers: Iterable[int]) -> tuple[SlotPort, ...]:
    return (
        *_vector_ports("position", "output", "m"),
        *_vector_ports("velocity", "output", "m/s"),
        *(SlotPort(f"orientation.{part}", "output", "1", False) for part in "wxyz"),
        *_vector_ports("angular_velocity", "output", "rad/s", False),
        *(port for i in numbers for port in _motion_ports("output", f"_{i}")),
    )


def _platform_inputs(numbers: Iterable[int]) -> tuple[SlotPort, ...]:
    return (
        *(port for i in numbers for port in _vector_ports(f"force_{i}", "input", "N")),
        *(port for i in numbers for port in _vector_ports(f"force_rate_{i}", "input", "N/s", False)),
        *(port for i in numbers for port in _vector_ports(f"middle_force_{i}", "input", "N", False)),
        *(port for i in numbers for port in _vector_ports(f"middle_force_rate_{i}", "input", "N/s", False)),
    )


def _cable_ports() -> tuple[SlotPort, ...]:
    return (
        *_motion_ports("input", ""),
        SlotPort("winch_speed", "input", "m/s", True),
        SlotPort("winch_acceleration", "input", "m/s2", False),
        *_vector_ports("force", "output", "N"),
        *_vector_ports("force_rate", "output", "N/s", False),
        SlotPort("tension", "output", "N", False),
        SlotPort("pull", "output", "N", False),
        *(SlotPort(name, "output", "m", False) for name in ("length", "elongation")),
        SlotPort("strain", "output", "1", False),
        *_vector_ports("middle_force", "output", "N", False),
        *_vector_ports("middle_force_rate", "output", "N/s", False),
    )


def _winch_ports() -> tuple[SlotPort, ...]:
    return (
        SlotPort("speed_command", "input", "m/s", True),
        SlotPort("speed_command_rate", "input", "m/s2", False),
        SlotPort("winch_speed", "output", "m/s", True),
        SlotPort("winch_acceleration", "output", "m/s2", False),
        SlotPort("command_margin", "output", "m/s", False),
        SlotPort("acceleration_margin", "output", "m/s2", False),
        SlotPort("speed_margin", "output", "m/s", False),
    )


def _vector_ports(name: str, causality: str, unit: str, required: bool = True) -> tuple[SlotPort, ...]:
    return tuple(SlotPort(f"{name}.{axis}", causality, unit, required) for axis in AXES)


def _motion_ports(causality: str, suffix: str) -> tuple[SlotPort, ...]:
    """Ports of the motion of a point of the platform, at the end of a step and in its middle."""
    return (
        *_vector_ports(f"position{suffix}", causality, "m"),
        *_vector_ports(f"velocity{suffix}", causality, "m/s"),
        *_vector_ports(f"acceleration{suffix}", causality, "m/s2", False),
        *_vector_ports(f"middle_position{suffix}", causality, "m", False),
        *_vector_ports(f"middle_velocity{suffix}", causality, "m/s", False),
        *_vector_ports(f"middle_acceleration{suffix}", causality, "m/s2", False),
    )


def missing_user_fmu_ports(user_fmus: Mapping[str, Path], cable_count: int, is_rigid: bool = False) -> frozenset[Port]:
    """Ports of the robot's wiring that user FMUs, by slot, do not have; raises SlotError where a file is no FMU.

    Rates of inputs need input_time: without it an FMU holds its inputs over a step and does not extrapolate.
    """
    missing = set()
    for slot, path in user_fmus.items():
        variable_names = {variable.name for variable in _runnable_description(UserFmu(slot, path)).modelVariables}
        for port in slot_ports(slot, cable_count, is_rigid):
            is_input_rate = port.causality == "input" and not port.required
            if port.name not in variable_names or (is_input_rate and INPUT_TIME not in variable_names):
                missing.add(Port(slot, port.name))
    return frozenset(missing)


def notes_on_user_fmus(robot: Robot) -> tuple[str, ...]:
    """Notes on user FMUs whose ports state no units, or that lack effects which ours would have."""
    notes = []
    for user_fmu in robot.fmus:
        effects = dict.fromkeys(_effects_of_slot(robot, user_fmu.slot))
        if effects:
            notes.append(f"{user_fmu.path}: effects of the robot file do not act in a user's FMU: {', '.join(effects)}")
        variables = {variable.name: variable for variable in _runnable_description(user_fmu).modelVariables}
        ports_without_unit = [port for port in _robot_slot_ports(robot, user_fmu.slot) if port.name in variables]
        ports_without_unit = [port for port in ports_without_unit if unit_of(variables[port.name]) is None]
        if ports_without_unit:
            first = f"{ports_without_unit[0].name} for {ports_without_unit[0].unit}"
            notes.append(
                f"{user_fmu.path}: {len(ports_without_unit)} ports have no unit and are assumed to have ours, such as "
                f"{first}"
            )
    return tuple(notes)


def _effects_of_slot(robot: Robot, slot: str) -> list[str]:
    """Names of the effects, and the word formula, that the FMU of a slot would have."""
    kind, _, number = slot.partition("_")
    if kind == "winch":
        return []
    if kind == "cable":
        formulas, settings = robot.formulas_on(int(number)), list(cable_settings(robot, int(number)))
    else:
        formulas = robot.formulas_on()
        settings = [each for each in platform_settings(robot) if not each.cables or shifts_position(each)]
        settings += [each for cable in robot.cable_numbers for each in attachment_settings(robot, cable)]
    return [*(setting.name for setting in settings), *(["formula"] if formulas else [])]


def require_step_support(user_fmus: Mapping[str, Path], adaptive: bool, equidistant: bool) -> None:
    """Refuse user FMUs, by slot, that do not support the communication steps of a run; raises SlotError.

    Steps are ``adaptive``, by a tolerance, or fixed, and of one length if ``equidistant``.
    """
    for slot, path in user_fmus.items():
        capabilities = _runnable_description(UserFmu(slot, path)).coSimulation
        if adaptive and not capabilities.canGetAndSetFMUstate:
            problem = "it cannot save its state, so steps cannot be chosen by a tolerance"
            raise SlotError(path, slot, None, problem, "give a step instead, such as --step 0.001")
        if not (equidistant or capabilities.canHandleVariableCommunicationStepSize):
            problem = "it supports steps of one length only, and these differ"
            raise SlotError(path, slot, None, problem, "give evenly spaced samples, and a step instead of a tolerance")


def parse_user_fmus(arguments: list[str], cable_count: int) -> tuple[UserFmu, ...]:
    """Parse user FMUs from command-line arguments ``SLOT=FILE``; raises InputError where one is not of that form."""
    user_fmus: dict[str, UserFmu] = {}
    for text in arguments:
        slot, equals, name = text.partition("=")
        slot_names = fmu_slots(cable_count)
        hint = (
            f"give a slot and a file, as in --fmu platform=mine.fmu; slots are {slot_names[0]}, "
            f"{slot_names[1]} ... {slot_names[-1]}"
        )
        if not equals or not name.strip() or slot not in slot_names:
            raise InputError("--fmu", f"{format_value(text)} names no slot of this robot and file", hint)
        if slot in user_fmus:
            raise InputError("--fmu", f"{slot} is given twice", "give it once")
        user_fmus[slot] = UserFmu(slot, Path(name))
    return tuple(user_fmus.values())


def check_user_fmus(robot: Robot) -> None:
    """Refuse user FMUs that do not fit their slots; raises SlotError."""
    slot_by_single_use_file: dict[Path, str] = {}
    for user_fmu in robot.fmus:
        description = _runnable_description(user_fmu, read_completely=True)
        if description.coSimulation.canBeInstantiatedOnlyOncePerProcess:
            occupied_slot = slot_by_single_use_file.setdefault(user_fmu.path.resolve(), user_fmu.slot)
            if occupied_slot != user_fmu.slot:
                problem = f"it is in slot {occupied_slot} and can be instantiated only once"
                raise SlotError(user_fmu.path, user_fmu.slot, None, problem, "export it without that restriction")
        variables = {variable.name: variable for variable in description.modelVariables}
        for port in _robot_slot_ports(robot, user_fmu.slot):
            _check_port(user_fmu, description, variables.get(port.name), port)


def _robot_slot_ports(robot: Robot, slot: str) -> tuple[SlotPort, ...]:
    return slot_ports(slot, robot.cable_count, robot.platform.is_rigid_body)


def _runnable_description(user_fmu: UserFmu, read_completely: bool = False) -> ModelDescription:
    """Model description of an FMU that can run here; the archive is read completely if ``read_completely``."""

    def slot_error(problem: str, hint: str) -> SlotError:
        return SlotError(user_fmu.path, user_fmu.slot, None, problem, hint)

    if not user_fmu.path.is_file():
        raise slot_error("there is no such file", "check the path")
    try:
        description = read_model_description(user_fmu.path, read_completely)
        platforms = fmpy.supported_platforms(str(user_fmu.path))
    except ArchiveError as error:
        raise slot_error(f"it {error.problem}", error.hint) from error
    # fmpy raises whatever the archive, the parser or its own checks do, plain Exception among them.
    except Exception as error:
        reason = format_value(" ".join(str(error).split()), MAX_REASON_CHARACTERS)
        raise slot_error(
            f"it cannot be read as an FMU ({reason})", "name an FMI 2.0 or 3.0 co-simulation FMU"
        ) from error
    if description.fmiVersion not in INSTANCE_TYPES:
        raise slot_error(f"it is FMI {description.fmiVersion}", EXPORT_HINT)
    if description.coSimulation is None:
        kind = "scheduled execution" if description.modelExchange is None else "model exchange"
        raise slot_error(f"it is for {kind} only", EXPORT_HINT)
    if fmpy.platform not in platforms:
        supported = ", ".join(platforms) or "no platform"
        raise slot_error(f"it has binaries for {supported}, none for {fmpy.platform}", f"export it for {fmpy.platform}")
    return description


def _check_port(
    user_fmu: UserFmu, description: ModelDescription, variable: ScalarVariable | None, port: SlotPort
) -> None:
    expected = f"a {INSTANCE_TYPES[description.fmiVersion].real_type} {port.causality} in {port.unit}"

    def slot_error(problem: str, hint: str) -> SlotError:
        return SlotError(user_fmu.path, user_fmu.slot, port.name, f"{port.name} {problem}", hint)

    if variable is None:
        if port.required:
            raise slot_error("is missing", f"give it a variable {port.name}, {expected}")
        return
    if not is_real_scalar(variable) or variable.causality != port.causality:
        raise slot_error(f"is a {type_name(variable)} {variable.causality}", f"make it {expected}")
    unit = unit_of(variable)
    stated_unit = (unit, None if unit is None else unit_definition(description, unit))
    if not same_unit(stated_unit, (port.unit, definition_from_exponents(UNITS[port.unit]))):
        raise slot_error(f"is in {unit!r}", f"make it {expected}")
