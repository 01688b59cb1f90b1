"""Figures of a linearised plant: Bode diagram, poles and zeros, modes along a path; by python-control where it can.

All are returned, none is shown: ``figure.savefig("bode.png")``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import control
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from ..arguments import of_kind
from ..array_arguments import rising_of
from ..errors import ArgumentError, described
from .along import ModesAlong
from .channels import minimal

Array = NDArray[np.float64]

BEYOND = 10.0
POINTS = 4000
MARGIN = 1.15
STYLES = ("-", "--", ":", "-.")


def bode_figure(system: Any, source: str, targets: Sequence[str] | str, frequencies: ArrayLike | None = None) -> Figure:
    """Bode diagram from one named input to some named outputs of a ``control.StateSpace``: gain and phase of G(i w).

    ``frequencies`` (N,) in Hz, rising, above 0; by default from a tenth of the slowest oscillation to ten times the
    fastest. The figure is returned, not shown.

    Raises InputError where a signal is unknown or no output is named, ArgumentError where an argument is none of these.
    """
    of_kind("bode_figure: system", system, control.StateSpace, "give a state space, such as linearise(robot).system")
    of_kind("bode_figure: source", source, str, f"name one of {', '.join(system.input_labels)}")
    names = _names("bode_figure: targets", targets, system.output_labels)
    omega = _around(system)
    if frequencies is not None:
        meaning = "finite frequencies (N,) in Hz that rise, two or more"
        omega = 2.0 * np.pi * rising_of("bode_figure: frequencies", frequencies, meaning, above=0.0)
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    for name in names:
        channel = minimal(system, source, name)
        begins = float(np.degrees(np.angle(channel(1j * omega[0]))))
        stacked = np.array([[axes[0]], [axes[1]]])
        control.bode_plot(channel, omega, Hz=True, initial_phase=begins, ax=stacked, label=name, title="", grid=True)
    axes[0].legend(loc="best")
    figure.suptitle(f"From {source}")
    return figure


def pole_figure(system: Any, source: str | None = None, target: str | None = None) -> Figure:
    """Poles of a ``control.StateSpace``; with a named input and output, poles and zeros of that channel alone.

    The frame fits the poles; the text tells of zeros beyond. Raises InputError where a signal is unknown.
    """
    single = source is not None and target is not None
    shown = minimal(system, source, target) if source is not None and target is not None else system
    figure = Figure(figsize=(6.0, 6.0), layout="constrained")
    axes = figure.subplots()
    poles, zeros = shown.poles(), shown.zeros() if single else np.zeros(0)
    control.pole_zero_plot(control.PoleZeroData(poles, zeros), ax=np.array([[axes]]), title="")
    reach = MARGIN * max(float(np.max(np.abs(poles.imag), initial=0.0)), 1e-6)
    left = min(MARGIN * float(np.min(poles.real, initial=0.0)), -0.1 * reach)
    axes.set_xlim(left, max(MARGIN * float(np.max(poles.real, initial=0.0)), 0.1 * reach))
    axes.set_ylim(-reach, reach)
    axes.set_xlabel("real part, rad/s")
    axes.set_ylabel("imaginary part, rad/s")
    beyond = [zero for zero in zeros if not (left <= zero.real <= axes.get_xlim()[1] and abs(zero.imag) <= reach)]
    told = f"; zeros beyond: {', '.join(f'{zero:.4g}' for zero in np.real_if_close(beyond))}" if beyond else ""
    figure.suptitle((f"{target} by {source}{told}") if single else "Poles")
    return figure


def modes_along_figure(runs: ModesAlong | Mapping[str, ModesAlong]) -> Figure:
    """Frequencies and damping ratios of the modes along a path, a colour for each mode.

    Several runs by name, as with the quasi-static and the dynamic modulus, get a line style each; the paper's Fig. 15.
    Over time in s, or distance travelled in m; frequencies in Hz. The figure is returned, not shown.

    Raises ArgumentError where ``runs`` is neither what ``modes_along`` returns nor a mapping of names to such.
    """
    named = _runs(runs)
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    for (name, run), style in zip(named.items(), STYLES * len(named), strict=False):
        for mode in range(run.frequencies.shape[1]):
            label = f"mode {mode + 1}" + (f", {name}" if name else "")
            look: dict[str, Any] = {"color": f"C{mode}", "linestyle": style, "label": label}
            upper.plot(run.abscissa, run.frequencies[:, mode], **look)
            lower.plot(run.abscissa, run.damping_ratios[:, mode], **look)
    upper.set_ylabel("frequency, Hz")
    lower.set_ylabel("damping ratio")
    timed = next(iter(named.values())).timed
    lower.set_xlabel("time, s" if timed else "distance travelled, m")
    for axes in (upper, lower):
        axes.grid(True, alpha=0.4)
    handles, labels = upper.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(named) if len(named) > 1 else 3)
    return figure


def _names(where: str, names: Sequence[str] | str, labels: Sequence[str]) -> list[str]:
    """One name or several as a list; raises ArgumentError for none."""
    mend = f"name some of {', '.join(labels)}"
    listed = [names] if isinstance(names, str) else names if isinstance(names, Iterable) else []
    found = [of_kind(where, name, str, mend) for name in listed]
    if not found:
        raise ArgumentError(where, names, f"is {described(names)} that names no output", mend)
    return found


def _runs(runs: ModesAlong | Mapping[str, ModesAlong]) -> Mapping[str, ModesAlong]:
    """The runs by name; raises ArgumentError."""
    if isinstance(runs, ModesAlong):
        return {"": runs}
    where, mend = "modes_along_figure: runs", "give what modes_along returns, or several by name"
    if not isinstance(runs, Mapping) or not runs:
        raise ArgumentError(where, runs, f"is {described(runs)} that holds no run", mend)
    for name, run in runs.items():
        of_kind(f"{where}[{name!r}]", run, ModesAlong, mend)
    return runs


def _around(system: Any) -> Array:
    """Angular frequencies about the oscillations of a system, in rad/s."""
    poles = system.poles()
    turning = np.abs(poles[np.abs(poles.imag) > 1e-9 * np.max(np.abs(poles), initial=1e-300)])
    if not len(turning):
        turning = np.ones(1)
    return np.geomspace(np.min(turning) / BEYOND, np.max(turning) * BEYOND, POINTS)
