"""Minimal realisations of single channels of a plant, from named inputs to named outputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import control
import numpy as np
from scipy.linalg import matrix_balance

from ..errors import InputError

# Relative to scaled matrices; values from 1e-11 to 1e-6 give the same orders on the shipped robots.
MINREAL_TOLERANCE = 1e-9


def minimal(
    system: Any,
    inputs: Sequence[str] | str | None = None,
    outputs: Sequence[str] | str | None = None,
    tolerance: float = MINREAL_TOLERANCE,
) -> Any:
    """Minimal realisation of a ``control.StateSpace`` from some inputs to some outputs, by name, with these names.

    None means all inputs, or all outputs.

    Uncontrollable and unobservable states are removed, such as unstrained lengths that the inputs do not drive or
    the outputs do not show. Scaled first, since position, force and tension differ by many powers of ten: time by
    the fastest eigenvalue, states by balancing, signals by their gains; then reduced by orthogonal
    staircases (slycot's TB01PD).

    Raises InputError where a signal is unknown.

    Source: Varga (1981), Proc. 20th IEEE CDC, 42-47.
    """
    rows = _signal_indices("output", system.output_labels if outputs is None else outputs, system.output_labels)
    columns = _signal_indices("input", system.input_labels if inputs is None else inputs, system.input_labels)
    A, B, C, D = (np.asarray(matrix, dtype=float) for matrix in (system.A, system.B, system.C, system.D))
    time_scale = max(float(np.max(np.abs(np.linalg.eigvals(A)), initial=0.0)), np.finfo(float).tiny)
    A, (state_scales, _) = matrix_balance(A / time_scale, permute=False, separate=True)
    B, C = B / state_scales[:, None] / time_scale, C * state_scales
    input_gains = np.maximum(np.linalg.norm(B, axis=0), np.finfo(float).tiny)[columns]
    output_gains = np.maximum(np.linalg.norm(C, axis=1), np.finfo(float).tiny)[rows]
    scaled = control.ss(
        A, B[:, columns] / input_gains, C[rows] / output_gains[:, None], np.zeros((len(rows), len(columns)))
    )
    reduced = scaled.minreal(tolerance)
    return control.ss(
        reduced.A * time_scale,
        reduced.B * time_scale * input_gains,
        reduced.C * output_gains[:, None],
        D[np.ix_(rows, columns)],
        inputs=[system.input_labels[column] for column in columns],
        outputs=[system.output_labels[row] for row in rows],
        name=f"{system.name}_minimal",
    )


def transfer_function(system: Any, source: str, target: str, tolerance: float = MINREAL_TOLERANCE) -> Any:
    """The transfer function from one named input to one named output, a ``control.TransferFunction`` of minimal order.

    It is that of :func:`minimal`. Raises InputError where a signal is unknown.
    """
    channel = minimal(system, source, target, tolerance)
    return control.ss2tf(channel, inputs=[source], outputs=[target], name=f"{target}_by_{source}")


def _signal_indices(kind: str, names: Sequence[str] | str, labels: Sequence[str]) -> list[int]:
    requested = [names] if isinstance(names, str) else list(names)
    if not requested:
        raise InputError(kind, f"no {kind} is named", f"choose among {', '.join(labels)}")
    for name in requested:
        if name not in labels:
            raise InputError(kind, f"there is no {kind} {name!r}", f"choose among {', '.join(labels)}")
    return [list(labels).index(name) for name in requested]
