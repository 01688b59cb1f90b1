"""Figures of a linearised plant: Bode diagram, poles and zeros, modes along a path.

Figures are returned, not shown: ``figure.savefig("bode.png")``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import control
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from ..array_validation import validate_increasing
from ..errors import ArgumentError, describe_value
from ..validation import validate_instance
from .linear_plant import minimal
from .modes_along_path import ModesAlong

Array = NDArray[np.float64]

FREQUENCY_MARGIN = 10.0
FREQUENCY_COUNT = 4000
FRAME_MARGIN = 1.15
LINE_STYLES = ("-", "--", ":", "-.")


def bode_figure(system: Any, source: str, targets: Sequence[str] | str, frequencies: ArrayLike | None = None) -> Figure:
    """Bode diagram from one named input to some named outputs of a ``control.StateSpace``: gain and phase of G(i w).

    ``frequencies`` (N,) in Hz, rising, above 0; by default from a tenth of the slowest oscillation to ten times the
    fastest. The figure is returned, not shown.

    Raises InputError where a signal is unknown or no output is named, ArgumentError for an invalid argument.
    """
    validate_instance(
        "bode_figure: system", system, control.StateSpace, "give a state space, such as linearise(robot).system"
    )
    validate_instance("bode_figure: source", source, str, f"name one of {', '.join(system.input_labels)}")
    names = _output_names("bode_figure: targets", targets, system.output_labels)
    omega = _frequency_grid(system)
    if frequencies is not None:
        meaning = "finite frequencies (N,) in Hz that rise, two or more"
        omega = 2.0 * np.pi * validate_increasing("bode_figure: frequencies", frequencies, meaning, lower_bound=0.0)
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    for name in names:
        channel = minimal(system, source, name)
        initial_phase = float(np.degrees(np.angle(channel(1j * omega[0]))))
        stacked = np.array([[axes[0]], [axes[1]]])
        control.bode_plot(
            channel, omega, Hz=True, initial_phase=initial_phase, ax=stacked, label=name, title="", grid=True
        )
    axes[0].legend(loc="best")
    figure.suptitle(f"From {source}")
    return figure


def pole_figure(system: Any, source: str | None = None, target: str | None = None) -> Figure:
    """Pole map of a ``control.StateSpace``; with a named input and output, poles and zeros of that channel alone.

    The axes fit the poles; the title lists zeros outside. Raises InputError where a signal is unknown.
    """
    is_channel = source is not None and target is not None
    drawn_system = minimal(system, source, target) if source is not None and target is not None else system
    figure = Figure(figsize=(6.0, 6.0), layout="constrained")
    axes = figure.subplots()
    poles, zeros = drawn_system.poles(), drawn_system.zeros() if is_channel else np.zeros(0)
    control.pole_zero_plot(control.PoleZeroData(poles, zeros), ax=np.array([[axes]]), title="")
    reach = FRAME_MARGIN * max(float(np.max(np.abs(poles.imag), initial=0.0)), 1e-6)
    left = min(FRAME_MARGIN * float(np.min(poles.real, initial=0.0)), -0.1 * reach)
    axes.set_xlim(left, max(FRAME_MARGIN * float(np.max(poles.real, initial=0.0)), 0.1 * reach))
    axes.set_ylim(-reach, reach)
    axes.set_xlabel("real part, rad/s")
    axes.set_ylabel("imaginary part, rad/s")
    outside_zeros = [
        zero for zero in zeros if not (left <= zero.real <= axes.get_xlim()[1] and abs(zero.imag) <= reach)
    ]
    outside_text = (
        f"; zeros beyond: {', '.join(f'{zero:.4g}' for zero in np.real_if_close(outside_zeros))}"
        if outside_zeros
        else ""
    )
    figure.suptitle((f"{target} by {source}{outside_text}") if is_channel else "Poles")
    return figure


def modes_along_figure(runs: ModesAlong | Mapping[str, ModesAlong]) -> Figure:
    """Frequencies and damping ratios of the modes along a path, one colour per mode.

    Several runs by name, as with the quasi-static and the dynamic modulus, get a line style each; the paper's Fig. 15.
    Over time in s, or distance travelled in m; frequencies in Hz. The figure is returned, not shown.

    Raises ArgumentError where ``runs`` is neither what ``modes_along`` returns nor a mapping of names to such.
    """
    named = _named_runs(runs)
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    for (name, run), style in zip(named.items(), LINE_STYLES * len(named), strict=False):
        for mode in range(run.frequencies.shape[1]):
            label = f"mode {mode + 1}" + (f", {name}" if name else "")
            style_options: dict[str, Any] = {"color": f"C{mode}", "linestyle": style, "label": label}
            upper.plot(run.abscissa, run.frequencies[:, mode], **style_options)
            lower.plot(run.abscissa, run.damping_ratios[:, mode], **style_options)
    upper.set_ylabel("frequency, Hz")
    lower.set_ylabel("damping ratio")
    timed = next(iter(named.values())).is_timed
    lower.set_xlabel("time, s" if timed else "distance travelled, m")
    for axes in (upper, lower):
        axes.grid(True, alpha=0.4)
    handles, labels = upper.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(named) if len(named) > 1 else 3)
    return figure


def _output_names(where: str, names: Sequence[str] | str, labels: Sequence[str]) -> list[str]:
    """One or several output names as a list; raises ArgumentError if there is none."""
    hint = f"name some of {', '.join(labels)}"
    candidates = [names] if isinstance(names, str) else names if isinstance(names, Iterable) else []
    output_names = [validate_instance(where, name, str, hint) for name in candidates]
    if not output_names:
        raise ArgumentError(where, names, f"is {describe_value(names)} that names no output", hint)
    return output_names


def _named_runs(runs: ModesAlong | Mapping[str, ModesAlong]) -> Mapping[str, ModesAlong]:
    """The runs as a mapping by name; raises ArgumentError."""
    if isinstance(runs, ModesAlong):
        return {"": runs}
    where, hint = "modes_along_figure: runs", "give what modes_along returns, or several by name"
    if not isinstance(runs, Mapping) or not runs:
        raise ArgumentError(where, runs, f"is {describe_value(runs)} that holds no run", hint)
    for name, run in runs.items():
        validate_instance(f"{where}[{name!r}]", run, ModesAlong, hint)
    return runs


def _frequency_grid(system: Any) -> Array:
    """Angular frequencies around the oscillatory poles of a system, in rad/s."""
    poles = system.poles()
    oscillation_frequencies = np.abs(poles[np.abs(poles.imag) > 1e-9 * np.max(np.abs(poles), initial=1e-300)])
    if not len(oscillation_frequencies):
        oscillation_frequencies = np.ones(1)
    return np.geomspace(
        np.min(oscillation_frequencies) / FREQUENCY_MARGIN,
        np.max(oscillation_frequencies) * FREQUENCY_MARGIN,
        FREQUENCY_COUNT,
    )
