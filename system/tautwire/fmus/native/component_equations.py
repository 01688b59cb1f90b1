"""Traced equations of components of native FMUs, by their resources."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from typing import Any

from .cable_functions import cable_functions
from .interpolation_functions import cubic_function, motion_functions, quadrature_functions, quintic_function
from .platform_functions import POINT_MASS_PARAMETERS, mass_functions
from .rigid_body_functions import rigid_body_functions
from .robot_functions import robot_functions, robot_structure
from .traced_functions import INDICATORS, TracedFunction
from .winch_functions import winch_functions

# Of a resource all that equations depend on; effects do by their names.
EQUATION_KEYS = ("law", "swivel_axis", "effects", "formulas", "attachments")


def _equation_structure(data: Mapping[str, Any]) -> str:
    if "cables" in data:
        return json.dumps(robot_structure(data), sort_keys=True)
    effects = [{**effect, "values": None} for effect in data.get("effects", ())]
    attachments = [None for _ in data.get("attachments", ())]
    structure = {name: data.get(name) for name in EQUATION_KEYS}
    return json.dumps({**structure, "effects": effects, "attachments": attachments}, sort_keys=True)


def component_equations(kind: str, data: Mapping[str, Any]) -> tuple[TracedFunction, ...]:
    """Traced equations of a component by its resource; those that agree in all that they depend on are traced once."""
    return _equations(kind, _equation_structure(data))


def indicator_count(kind: str, data: Mapping[str, Any]) -> int:
    """Number of event indicators of a component, by its traced equations."""
    functions = component_equations(kind, data)
    return sum(function.outputs.get(INDICATORS, 0) for function in functions)


@cache
def _equations(kind: str, structure: str) -> tuple[TracedFunction, ...]:
    """Traced equations of a kind of component; ``structure`` is that part of its resource, as JSON."""
    data = json.loads(structure)
    functions: tuple[TracedFunction, ...]
    if kind == "cable":
        functions = (*cable_functions(data), *motion_functions())
    elif kind == "point_mass":
        functions = (*mass_functions(data, POINT_MASS_PARAMETERS), *quadrature_functions(), quintic_function())
    elif kind == "rigid_body":
        functions = (*rigid_body_functions(data), *quadrature_functions(), quintic_function())
    elif kind == "robot":
        functions = robot_functions(data)
    else:
        functions = winch_functions() if kind == "winch" else ()
    return (*functions, cubic_function())
