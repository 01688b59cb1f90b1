"""Reads a controller from a file: a controller FMU, a state space in JSON, or a Python function."""

from __future__ import annotations

import json
import runpy
from pathlib import Path
from typing import Any

import control

from ..errors import ArgumentError, InputError, describe_value, format_value
from ..input_files import read_bytes, require_utf8_text
from ..validation import validate_file
from .design import RegulatorDesign
from .external_controller import SpeedLaw, state_space_controller

MAX_FILE_SIZE = 100_000_000  # bytes
FUNCTION_NAME = "controller"


class ControllerFileError(InputError):
    """A file does not contain a controller."""


def read_controller(path: Path, cable_count: int, is_rigid: bool = False) -> Any:
    """Reads a controller for :func:`cosimulate_closed_loop`: the path of an ``.fmu``, a design or a function.

    ``.json`` has ``A``, ``B``, ``C``, ``D``, ``dt`` and optionally ``inputs`` and ``outputs``; ``.py`` is executed and
    has a function ``controller(time, measured)``.

    The robot's platform is a point mass, or turns if it ``is_rigid``.

    Raises ControllerFileError where a file has other content, ArgumentError where there is none.
    """
    suffix = path.suffix.lower()
    if suffix not in (".fmu", ".json", ".py"):
        hint = "give an FMU (.fmu), a state space (.json) or Python (.py)"
        raise ControllerFileError(str(path), f"has the ending {format_value(path.suffix)}", hint)
    file = validate_file("--controller", path)
    if suffix == ".fmu":
        return file
    return _read_state_space(file, cable_count, is_rigid) if suffix == ".json" else _read_function(file)


def _read_state_space(path: Path, cable_count: int, is_rigid: bool) -> RegulatorDesign:
    content = read_bytes(path, ControllerFileError, MAX_FILE_SIZE)
    require_utf8_text(content, str(path), ControllerFileError, "JSON")
    hint = "write A, B, C, D as lists of rows, and dt in s, 0 if continuous"
    try:
        document = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise ControllerFileError(str(path), f"is not JSON ({error})", hint) from error
    if not isinstance(document, dict):
        raise ControllerFileError(str(path), f"is {describe_value(document)}, not an object", hint)
    missing = [key for key in ("A", "B", "C", "D", "dt") if key not in document]
    if missing:
        raise ControllerFileError(str(path), f"has no {', '.join(missing)}", hint)
    labels = {key: document[key] for key in ("inputs", "outputs") if document.get(key) is not None}
    try:
        matrices = [document[key] for key in "ABCD"]
        system = control.ss(*matrices, document["dt"], remove_useless_states=False, **labels)
    except Exception as error:
        raise ControllerFileError(str(path), f"is not a state space ({error})", hint) from error
    try:
        return state_space_controller(system, cable_count, is_rigid=is_rigid)
    except ArgumentError as error:
        raise ControllerFileError(str(path), error.problem, error.hint) from error


def _read_function(path: Path) -> SpeedLaw:
    try:
        function = runpy.run_path(str(path)).get(FUNCTION_NAME)
    except (Exception, SystemExit) as error:
        hint = "correct it; modules beside it are not on Python's path"
        raise ControllerFileError(str(path), f"raised {type(error).__name__}: {error}", hint) from error
    if not callable(function):
        hint = f"define {FUNCTION_NAME}(time, measured), which returns the winch speeds"
        raise ControllerFileError(str(path), f"has no function {FUNCTION_NAME}", hint)
    result: SpeedLaw = function
    return result
