"""Single channels of a plant, from named inputs to named outputs, without the states that do not act in them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import control
import numpy as np
from scipy.linalg import matrix_balance

from ..errors import InputError

# Relative to scaled matrices; any from 1e-11 to 1e-6 gives the same orders on the shipped robots.
TOLERANCE = 1e-9


def minimal(
    system: Any,
    inputs: Sequence[str] | str | None = None,
    outputs: Sequence[str] | str | None = None,
    tolerance: float = TOLERANCE,
) -> Any:
    """Minimal realisation of a ``control.StateSpace`` from some inputs to some outputs, by name, with these names.

    None stands for all inputs, or all outputs.

    Unstrained lengths that the inputs do not drive, or that the outputs do not show, go, as do all other states
    of that kind. Scaled first, since position, force and tension differ by many powers of ten: time by the fastest
    eigenvalue, states by balancing, signals by their gains; then reduced by orthogonal staircases (slycot's TB01PD).

    Raises InputError where a signal is unknown.

    Source: Varga (1981), Proc. 20th IEEE CDC, 42-47.
    """
    rows = _places("output", system.output_labels if outputs is None else outputs, system.output_labels)
    columns = _places("input", system.input_labels if inputs is None else inputs, system.input_labels)
    A, B, C, D = (np.asarray(matrix, dtype=float) for matrix in (system.A, system.B, system.C, system.D))
    pace = max(float(np.max(np.abs(np.linalg.eigvals(A)), initial=0.0)), np.finfo(float).tiny)
    A, (sizes, _) = matrix_balance(A / pace, permute=False, separate=True)
    B, C = B / sizes[:, None] / pace, C * sizes
    into = np.maximum(np.linalg.norm(B, axis=0), np.finfo(float).tiny)[columns]
    out = np.maximum(np.linalg.norm(C, axis=1), np.finfo(float).tiny)[rows]
    scaled = control.ss(A, B[:, columns] / into, C[rows] / out[:, None], np.zeros((len(rows), len(columns))))
    reduced = scaled.minreal(tolerance)
    return control.ss(
        reduced.A * pace,
        reduced.B * pace * into,
        reduced.C * out[:, None],
        D[np.ix_(rows, columns)],
        inputs=[system.input_labels[column] for column in columns],
        outputs=[system.output_labels[row] for row in rows],
        name=f"{system.name}_minimal",
    )


def transfer_function(system: Any, source: str, target: str, tolerance: float = TOLERANCE) -> Any:
    """The transfer function from one named input to one named output, a ``control.TransferFunction`` of lowest order.

    That of :func:`minimal`. Raises InputError where a signal is unknown.
    """
    channel = minimal(system, source, target, tolerance)
    return control.ss2tf(channel, inputs=[source], outputs=[target], name=f"{target}_by_{source}")


def _places(kind: str, names: Sequence[str] | str, labels: Sequence[str]) -> list[int]:
    wanted = [names] if isinstance(names, str) else list(names)
    if not wanted:
        raise InputError(kind, f"no {kind} is named", f"choose among {', '.join(labels)}")
    for name in wanted:
        if name not in labels:
            raise InputError(kind, f"there is no {kind} {name!r}", f"choose among {', '.join(labels)}")
    return [list(labels).index(name) for name in wanted]
