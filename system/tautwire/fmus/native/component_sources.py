"""C source of a native FMU: the structure of its component, its start values, its equations, and the slave around."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from typing import Any

from tautwire_fmu import dormand_prince as integration
from tautwire_fmu.cable_slave import LENGTH_SCALE
from tautwire_fmu.effect_variables import effects_from_resource
from tautwire_fmu.laws.sampled_control import plan_from_resource
from tautwire_fmu.model_description import Variable
from tautwire_fmu.slave import MIDDLE_TIME, Slave

from .cable_functions import START_SIZE
from .component_equations import component_equations, indicator_count
from .interpolation_functions import (
    MOTION_SIZE,
)
from .model_exchange import further_variables
from .platform_functions import SENSOR_SIZE
from .rigid_body_functions import start_size
from .robot_slave import WholeRobot
from .robot_structure import robot_constants, robot_macros, robot_state_scales
from .traced_functions import LARGEST_NUMBER, c_source
from .winch_functions import DRIVE_SIZE, LIMIT_COUNT

ENTRY_FILE = "all.c"
CODE_FILE = "code.c"
START_FILE = "start_values.c"
STRUCTURE_FILE = "structure.h"
EQUATIONS_FILE = "equations.c"
DELAY_FILE = "delayed_signal.c"
SLAVE_FILES = ("slave.c", "saved_state.c", "partial_derivatives.c")
FMI_FILES = {2: ("fmi2.c",), 3: ("fmi3.c", "fmi3_absent.c")}
MODEL_EXCHANGE_FILES = {fmi: ("model_exchange.c", f"fmi{fmi}_model_exchange.c") for fmi in FMI_FILES}
# The input whose rate another input is, by the names without axis.
RATE_NAMES = {
    "position": "velocity",
    "velocity": "acceleration",
    "winch_speed": "winch_acceleration",
    "speed_command": "speed_command_rate",
}
VALUES_A_LINE = 5
START_DECLARATIONS = (
    "extern const char model_guid[];\nextern const double model_start[], model_constants[], model_nominals[];"
)


@dataclass(frozen=True)
class ComponentSources:
    """C files of a native FMU by name.

    ``code.c`` and what it includes depend on the structure alone: law, effects, formulas and number of cables. All
    other numbers are start values, in ``start_values.c``; ``all.c`` includes both.
    ``further_variables`` are those that model exchange adds.
    """

    files: Mapping[str, str]
    further_variables: tuple[Variable, ...] = ()


@dataclass(frozen=True)
class _Component:
    """What a component contributes: C files, macros, and constants beside the variables.

    With a number of event indicators, be it zero, it can do model exchange; None is for co-simulation only.
    """

    c_files: tuple[str, ...]
    macros: Mapping[str, Any]
    constants: Sequence[float] = ()
    state_scales: Sequence[float] = ()
    indicator_count: int | None = None


def component_sources(
    kind: str, slave: Slave, data: Mapping[str, Any], guid: str, fmi: int, model_exchange: bool = True
) -> ComponentSources:
    """C source of a component by its resource ``data``, with the variables of its Python ``slave``.

    ``fmi`` is the major version of FMI; without ``model_exchange`` the component is for co-simulation only.
    """
    component = COMPONENTS[kind](slave, data)
    if not model_exchange:
        component = replace(component, indicator_count=None)
    further = () if component.indicator_count is None else further_variables(slave, component.indicator_count)
    shared = ("numbers.h", "delay_line.c", "dormand_prince.c", "slave.h", DELAY_FILE, *SLAVE_FILES)
    names = [*shared, *FMI_FILES[fmi], *component.c_files, *(MODEL_EXCHANGE_FILES[fmi] if further else ())]
    sources = {name: files(__package__).joinpath(f"c/{name}").read_text(encoding="utf-8") for name in names}
    structure = _structure(slave, component, further)
    return ComponentSources(
        {
            **sources,
            STRUCTURE_FILE: structure,
            EQUATIONS_FILE: c_source(component_equations(kind, data)),
            CODE_FILE: _code(component, fmi),
            START_FILE: _start_values(slave, component, guid),
            ENTRY_FILE: _entry(data["model_name"], fmi),
        },
        further,
    )


def _cable(slave: Slave, data: Mapping[str, Any]) -> _Component:
    effects = effects_from_resource(dict(data))
    scales = (LENGTH_SCALE, LENGTH_SCALE, *(state.scale for effect in effects for state in effect.states))
    macros = {"MOTION_SIZE": MOTION_SIZE, "START_SIZE": START_SIZE, "SIGNAL_AXES": 1, "SIGNAL_DERIVATIVES": 2}
    return _Component(("cable.c",), macros, state_scales=scales, indicator_count=indicator_count("cable", data))


def _point_mass(slave: Slave, data: Mapping[str, Any]) -> _Component:
    names = [variable.name for variable in slave.variables]
    start_velocity = data.get("start_velocity", (0.0, 0.0, 0.0))
    macros = _platform_macros(slave, data) | {"FIRST_FORCE": names.index("force_1.x")}
    count = indicator_count("point_mass", data)
    return _Component(("platform.c", "point_mass.c"), macros, start_velocity, indicator_count=count)


def _rigid_body(slave: Slave, data: Mapping[str, Any]) -> _Component:
    names = [variable.name for variable in slave.variables]
    origin = (0.0, 0.0, 0.0)
    constants = (*data.get("start_velocity", origin), *data.get("start_angular_velocity", origin))
    cable_count = len(data["attachments"])
    macros = _platform_macros(slave, data) | {
        "FIRST_FORCE": names.index("force_1.x"),
        "FIRST_OUTPUT": names.index("position.x"),
        "FIRST_ATTACHMENT_OUTPUT": names.index("position_1.x"),
        "MIDDLE_OUTPUT": names.index("middle_position_1.x"),
        "CABLE_COUNT": cable_count,
        "START_SIZE": start_size(cable_count),
    }
    c_files = ("platform.c", "principal_axes.c", "rigid_body.c")
    return _Component(c_files, macros, constants, indicator_count=indicator_count("rigid_body", data))


def _platform_macros(slave: Slave, data: Mapping[str, Any]) -> dict[str, Any]:
    names = [variable.name for variable in slave.variables]
    effects = effects_from_resource(dict(data))
    macros: dict[str, Any] = {
        "FORCE_COUNT": len(data["start_forces"]) + 1,
        "HAS_MOTION_DEPENDENT_FORCE": int(any(effect.wrench is not None for effect in effects)),
        "START_SIZE": SENSOR_SIZE,
        "SIGNAL_AXES": 3,
        "SIGNAL_DERIVATIVES": 3,
    }
    if "measured_position.x" in names:
        macros["MEASURED_POSITION"] = names.index("measured_position.x")
    if any(effect.states for effect in effects):
        macros["TIME_INDEX"] = slave.time_index
    return macros


def _winch(slave: Slave, data: Mapping[str, Any]) -> _Component:
    macros = {"START_SIZE": DRIVE_SIZE, "SIGNAL_AXES": 1, "SIGNAL_DERIVATIVES": 2}
    return _Component(("winch.c",), macros, indicator_count=LIMIT_COUNT)


def _controller(slave: Slave, data: Mapping[str, Any]) -> _Component:
    plan = plan_from_resource(dict(data))
    cables, order = len(plan.compliances), len(plan.gains[0].A)
    macros = {"CABLES": cables, "ORDER": order, "POSE_SIZE": plan.pose_size, "START_SIZE": 1}
    macros |= {"SIGNAL_AXES": 1, "SIGNAL_DERIVATIVES": 2}
    gains = [entry for each in plan.gains for matrix in each for row in matrix for entry in row]
    tables = (plan.speeds, plan.stretches, plan.expected)
    constants = [
        *(plan.period, plan.yield_time, float(plan.tares), len(plan.knots), *map(len, tables)),
        *(*plan.at_rest, *plan.compliances, *plan.knots, *gains),
        *(entry for table in tables for row in table for entry in row),
    ]
    return _Component(("sampled_control.c", "controller.c"), macros, constants)


def _robot(slave: Slave, data: Mapping[str, Any]) -> _Component:
    assert isinstance(slave, WholeRobot)
    scales = robot_state_scales(slave, data)
    c_files = ("principal_axes.c", "robot.c", "robot_derivatives.c")
    return _Component(c_files, robot_macros(slave, data), robot_constants(data), scales)


COMPONENTS: Mapping[str, Callable[[Slave, Mapping[str, Any]], _Component]] = {
    "cable": _cable,
    "point_mass": _point_mass,
    "rigid_body": _rigid_body,
    "winch": _winch,
    "controller": _controller,
    "robot": _robot,
}


def _structure(slave: Slave, component: _Component, further: Sequence[Variable]) -> str:
    """Counts and tables of the variables, and the tableau of the adaptive integration."""
    variables, parameters = slave.variables, slave.variables[slave.first_parameter :]
    names = [variable.name for variable in (*variables, *further)]
    macros: dict[str, Any] = {
        "VARIABLE_COUNT": len(variables),
        "INPUT_COUNT": slave.input_count,
        "FIRST_PARAMETER": slave.first_parameter,
        "FIRST_STATE": slave.states.start,
        "STATE_COUNT": slave.states.stop - slave.states.start,
        **component.macros,
        **{name: repr(getattr(integration, name)) for name in INTEGRATION_CONSTANTS},
    }
    if component.indicator_count is not None:
        macros |= {"MODEL_EXCHANGE": 1, "INDICATOR_COUNT": component.indicator_count}
    if MIDDLE_TIME.name in names:
        macros["MIDDLE_TIME"] = names.index(MIDDLE_TIME.name)
    digest = hashlib.sha256(json.dumps([names, macros], sort_keys=True).encode()).hexdigest()[:16]
    macros["MODEL_STRUCTURE"] = f'"{digest}"'
    unused_scale = [1.0] * (slave.states.stop - slave.states.start)
    return "\n".join(
        [
            "/* Written by Tautwire: the structure of this component. */",
            *(f"#define {name} {value}" for name, value in macros.items()),
            _table("char *const", "variable_names", [f'"{name}"' for name in names]),
            _table("char", "is_output", [str(int(variable.causality == "output")) for variable in variables]),
            _table("unsigned int", "rate_references", [str(each) for each in rate_references(variables)]),
            _numbers("minima", [_bound(each.minimum, -LARGEST_NUMBER) for each in parameters]),
            _numbers("maxima", [_bound(each.maximum, LARGEST_NUMBER) for each in parameters]),
            _numbers("state_scales", component.state_scales or unused_scale),
            _numbers("stage_times", integration.STAGE_TIMES),
            _numbers("solution_weights", integration.SOLUTION_WEIGHTS),
            _numbers("error_weights", integration.ERROR_WEIGHTS),
            _stage_weights(),
            "",
        ]
    )


INTEGRATION_CONSTANTS = (
    "RELATIVE_TOLERANCE",
    "MIN_RELATIVE_TOLERANCE",
    "MAX_RELATIVE_TOLERANCE",
    "MIN_STEP_FRACTION",
    "SAFETY_FACTOR",
    "MIN_STEP_FACTOR",
    "MAX_STEP_FACTOR",
)


def rate_references(variables: Sequence[Variable]) -> list[int]:
    """Of each variable the reference of its rate, the number of variables where it has none."""
    references = {variable.name: index for index, variable in enumerate(variables)}
    rates = {variable.rate_of: variable.name for variable in variables if variable.rate_of is not None}
    names = [rates.get(v.name, _input_rate_name(v.name)) for v in variables]
    return [references.get(name, len(variables)) for name in names]


def _input_rate_name(name: str) -> str:
    base, dot, axis = name.partition(".")
    stem = re.sub(r"_\d+$", "", base)
    is_load = re.fullmatch(r"(external_)?(force|moment)", stem)
    rate = f"{stem}_rate" if is_load else RATE_NAMES.get(stem, "")
    return f"{rate}{base[len(stem) :]}{dot}{axis}"


def _bound(value: float | None, absent: float) -> float:
    return absent if value is None else value


def _code(component: _Component, fmi: int) -> str:
    """The translation unit of everything but the start values."""
    common = ("numbers.h", STRUCTURE_FILE, EQUATIONS_FILE, "delay_line.c", "slave.h", DELAY_FILE)
    inside, behind = ((), ()) if component.indicator_count is None else ((each,) for each in MODEL_EXCHANGE_FILES[fmi])
    names = (*common, *component.c_files, *SLAVE_FILES, *inside, f"fmi{fmi}.c", *behind)
    declarations = f"#ifndef MODEL_SCOPE\n#define MODEL_SCOPE extern\n{START_DECLARATIONS}\n#endif\n"
    return declarations + "".join(f'#include "{name}"\n' for name in names)


def _start_values(slave: Slave, component: _Component, guid: str) -> str:
    nominals = [variable.nominal or 1.0 for variable in slave.variables[slave.states]]
    return "\n".join(
        [
            "/* Written by Tautwire: the start values of this component. */",
            f"#ifndef MODEL_SCOPE\n#define MODEL_SCOPE\n{START_DECLARATIONS}\n#endif",
            f'MODEL_SCOPE const char model_guid[] = "{guid}";',
            _numbers("model_start", slave.real, "MODEL_SCOPE"),
            _numbers("model_constants", component.constants or [0.0], "MODEL_SCOPE"),
            _numbers("model_nominals", nominals or [1.0], "MODEL_SCOPE"),
            "",
        ]
    )


def _entry(name: str, fmi: int) -> str:
    """The single translation unit of a source FMU; its functions have the model identifier as a prefix."""
    return (
        "/* Written by Tautwire: all of this FMU in one translation unit. */\n"
        f"#ifndef FMI{fmi}_OVERRIDE_FUNCTION_PREFIX\n#define FMI{fmi}_FUNCTION_PREFIX {name}_\n#endif\n"
        f'#define MODEL_SCOPE static\n#include "{START_FILE}"\n#include "{CODE_FILE}"\n'
    )


def _stage_weights() -> str:
    count = max(map(len, integration.STAGE_WEIGHTS))
    rows = [", ".join(map(repr, [*row, *[0.0] * (count - len(row))])) for row in integration.STAGE_WEIGHTS]
    lines = "".join(f"  {{{row}}},\n" for row in rows)
    return f"static const double stage_weights[][{count}] = {{\n{lines}}};"


def _numbers(name: str, values: Sequence[float], scope: str = "static") -> str:
    return _table("double", name, [repr(float(value)) for value in values], scope)


def _table(element: str, name: str, values: Sequence[str], scope: str = "static") -> str:
    lines = "".join(f"  {', '.join(values[k : k + VALUES_A_LINE])},\n" for k in range(0, len(values), VALUES_A_LINE))
    return f"{scope} const {element} {name}[] = {{\n{lines}}};"
