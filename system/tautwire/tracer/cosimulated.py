"""Robots co-simulated beside the recordings, through their FMUs: what a trace's errors before and after are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from ..fmus.packaging import build_fmus
from ..recordings.recording import Recording
from ..robots.robot import Robot
from ..runs.cosimulation import Motion, cosimulate
from .data import Sample
from .fit import Fitter
from .preparation.calibration import calibrated
from .preparation.release import released
from .verdict import Comparison, Errors
from .workers import Pending, Workers

Array = NDArray[np.float64]

ROLES = ("fit", "check")
REACHED = 1.5


def started(workers: Workers, fitter: Fitter, robot: Robot, samples: Sequence[Sample]) -> list[Pending[Motion]]:
    """The runs of a robot over some recordings, begun; each from where and how fast its recording starts."""
    return [workers.start(cosimulated, released(fitter, robot, sample), sample) for sample in samples]


def cosimulated(robot: Robot, sample: Sample) -> Motion:
    """The run of a robot placed where a recording starts."""
    with TemporaryDirectory(prefix="tautwire-trace-") as folder:
        fmus = build_fmus(robot.as_modelled(), Path(folder))
        return cosimulate(fmus, sample.recording.time, sample.recording.winch_speed)


def reaching(
    after: Robot, fitter: Fitter, samples: Sequence[Sample], before: Sequence[Motion], workers: Workers
) -> tuple[tuple[Comparison, ...], list[Errors]] | None:
    """What the co-simulation of a better robot leaves; None where that is more than noise.

    It has the last word: a filter follows what the model itself would not do.
    """
    runs = [run.result() for run in started(workers, fitter, after, samples)]
    better, lower = compared(after, fitter, samples, before, runs)
    reached = all(_reached(c.errors_after, floor) for c, floor in zip(better, lower, strict=True))
    return (better, lower) if reached else None


def compared(
    robot: Robot,
    fitter: Fitter,
    samples: Sequence[Sample],
    before: Sequence[Motion],
    after: Sequence[Motion],
) -> tuple[tuple[Comparison, ...], list[Errors]]:
    """Both runs beside each recording, and what noise alone would leave there under the later robot.

    Recordings are shown without the constant errors that their sensors may have, as far as those are stated.
    """
    shown = [calibrated(fitter, robot, sample).recording(sample.recording) for sample in samples]
    comparisons = tuple(
        Comparison(role, recording, b, a, errors(recording, b), errors(recording, a))
        for role, recording, b, a in zip(ROLES, shown, before, after, strict=False)
    )
    return comparisons, [floor_of(fitter, robot, sample) for sample in samples]


def errors(recording: Recording, motion: Motion) -> Errors:
    """Root mean squares of measured less co-simulated."""
    return _root_mean_squares((recording.measured() - motion.measured()) ** 2)


def floor_of(fitter: Fitter, robot: Robot, sample: Sample) -> Errors:
    """What sensors and the recorded winch speeds' noise alone would leave in a simulation of this recording."""
    variances = fitter.open_loop_variances(robot, sample)
    return _root_mean_squares(np.where(np.isfinite(sample.recording.measured()), variances, np.nan))


def _reached(after: Errors, floor: Errors) -> bool:
    """Whether a co-simulation errs by no more than half over what noise alone leaves."""
    pairs = ((after.position_rms, floor.position_rms), (after.tension_rms, floor.tension_rms))
    return all(not error > REACHED * least for error, least in pairs)


def _root_mean_squares(squares: Array) -> Errors:
    return Errors(
        position_rms=_root_mean(squares[:, :3]),
        tension_rms=_root_mean(squares[:, 3:]),
        axes=np.array([_root_mean(column) for column in squares[:, :3].T]),
        cables=np.array([_root_mean(column) for column in squares[:, 3:].T]),
    )


def _root_mean(squares: Array) -> float:
    seen = squares[np.isfinite(squares)]
    return float(np.sqrt(np.mean(seen))) if seen.size else float("nan")
