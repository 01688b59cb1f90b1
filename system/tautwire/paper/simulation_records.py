"""Co-simulates the paper's robots, records runs as named series, and computes the ledger's numbers from them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.signal import find_peaks
from scipy.signal.windows import hann

from ..cosimulation.robot_cosimulation import CosimulationResult, cosimulate
from ..errors import TautwireError
from ..fmus.packaging import build_fmus
from ..recordings.start_position import with_start
from ..robot.schema import Robot
from ..robot.trajectory import Trajectory
from ..robot.winch_speeds import ideal_winch_speeds
from .paper_parameters import WinchRamp

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

MACRO_STEP = 0.1  # s, macro step; its error on the ramps is micrometres
NEWTON_TOLERANCE, MAX_NEWTON_ITERATIONS = 1e-12, 30

# Computed values by the ids of the claims, in the claims' units; two numbers are a range.
ClaimValues = dict[str, float | tuple[float, float] | None]
# s, within which turning points of two curves belong together.
TURN_WINDOW = 1.5
DRIFT_POLYNOMIAL_ORDER = 8
MIN_PERIODS = 4.0
ZERO_PADDING_FACTOR = 16


@dataclass(frozen=True)
class SimulationCase:
    """Inputs of one run: winch speeds (N, n) in m/s at ``time`` (N,) in s, and the ``desired_position`` (N, 3) in m."""

    robot: Robot
    time: Array
    winch_speed: Array
    desired_position: Array


@dataclass(frozen=True)
class SimulationRecord:
    """Recorded series (N,) by name over ``time`` (N,) in s, SI units.

    Of a run: ``tension_1``, ``elongation_1``, ``strain_1`` (the paper's r / l), ``length_1``, ``winch_speed_1`` ...;
    ``x``, ``vx``, ``error_x`` ... (desired less real); ``error_norm``. ``coupling_energy_share`` is
    the energy that the coupling generated as a share of all that was exchanged.
    """

    time: Array
    values: Mapping[str, Array] = field(repr=False)
    coupling_energy_share: float = 0.0

    def __getitem__(self, name: str) -> Array:
        return self.values[name]

    def at(self, name: str, time: float) -> float:
        """Value of a series at a time in s, linear between samples."""
        return float(np.interp(time, self.time, self.values[name]))


Records = Mapping[str, SimulationRecord]


class RigidPathError(TautwireError):
    """Inelastic ropes of these lengths have no common end near the last one; ``time`` in s."""

    def __init__(self, robot: str, time: float) -> None:
        self.robot = robot
        self.time = time
        super().__init__(f"{robot}: inelastic ropes meet nowhere at {time:g} s")


def path_case(robot: Robot, path: Trajectory, samples: int) -> SimulationCase:
    """The run that follows a path with the winch speeds of inelastic ropes, in ``samples`` intervals."""
    time = np.linspace(0.0, path.duration, samples + 1)
    return SimulationCase(robot, time, ideal_winch_speeds(robot, path, time), path.position(time))


def ramp_case(robot: Robot, ramp: WinchRamp, samples: int) -> SimulationCase:
    """The run of a winch ramp; inelastic ropes give the desired path. Corners of the ramp have to be samples."""
    placed = with_start(robot, ramp.start)
    time = np.linspace(0.0, ramp.duration, samples + 1)
    speeds = ramp.speeds(time)
    return SimulationCase(placed, time, speeds, rigid_path(placed, time, speeds))


def rigid_path(robot: Robot, time: Array, winch_speed: Array) -> Array:
    """Forward kinematics of three inelastic ropes, (N, 3) in m: ``|p - b_i| = l_i(0) - integral V_i dt``, by Newton.

    ``time`` (N,) in s; ``winch_speed`` (N, 3) in m/s, linear in between. Raises RigidPathError.
    """
    anchors, position = np.array(robot.anchors), np.array(robot.platform.start)
    lengths = np.linalg.norm(position - anchors, axis=1) - reeled_length(time, winch_speed)
    path = np.empty((len(time), 3))
    for row, target_lengths in enumerate(lengths):
        for _ in range(MAX_NEWTON_ITERATIONS):
            spans = position - anchors
            current_lengths = np.linalg.norm(spans, axis=1)
            position_change = np.linalg.solve(spans / current_lengths[:, None], target_lengths - current_lengths)
            position = position + position_change
            if np.max(np.abs(position_change)) < NEWTON_TOLERANCE * np.max(current_lengths):
                break
        else:
            raise RigidPathError(robot.name, float(time[row]))
        path[row] = position
    return path


def reeled_length(time: Array, winch_speed: Array) -> Array:
    """Rope reeled in since the start, in m, of speeds (N, n) that are linear between samples."""
    return np.asarray(cumulative_trapezoid(winch_speed, time, axis=0, initial=0))


def run_case(case: SimulationCase) -> SimulationRecord:
    """Build the FMUs of a case and co-simulate them; raises RunError where an FMU fails."""
    with TemporaryDirectory(prefix="tautwire-paper-") as folder:
        fmus = build_fmus(case.robot, Path(folder))
        return record_from_motion(cosimulate(fmus, case.time, case.winch_speed, step=MACRO_STEP), case)


def record_from_motion(motion: CosimulationResult, case: SimulationCase) -> SimulationRecord:
    """Record the series of a run."""
    return SimulationRecord(motion.time, dict(_series(motion, case)), motion.statistics.energy_residual_share)


def _series(motion: CosimulationResult, case: SimulationCase) -> Iterator[tuple[str, Array]]:
    error = case.desired_position - motion.position
    for index, axis in enumerate("xyz"):
        yield axis, motion.position[:, index]
        yield f"v{axis}", motion.velocity[:, index]
        yield f"error_{axis}", error[:, index]
    yield "error_norm", np.linalg.norm(error, axis=1)
    for index in range(case.robot.cable_count):
        number = index + 1
        yield f"tension_{number}", motion.tension[:, index]
        yield f"length_{number}", motion.length[:, index]
        yield f"elongation_{number}", motion.elongation[:, index]
        yield f"strain_{number}", motion.elongation[:, index] / motion.length[:, index]
        yield f"winch_speed_{number}", case.winch_speed[:, index]


def max_abs(series: Array) -> float:
    """The largest absolute value."""
    return float(np.max(np.abs(series)))


def relative_difference(base: SimulationRecord, other: SimulationRecord, name: str, time: float) -> float:
    """Relative difference of another run's series at a time (s), in % of the base's there."""
    return 100.0 * abs(other.at(name, time) - base.at(name, time)) / abs(base.at(name, time))


@dataclass(frozen=True)
class TurningPoint:
    """A turning point of two curves of one quantity, each at its own time: ``time`` in s is halfway between."""

    time: float
    first: float
    second: float

    @property
    def gap(self) -> float:
        """Difference of the two extremes."""
        return abs(self.first - self.second)


def turning_points(
    first: SimulationRecord, second: SimulationRecord, name: str, prominence: float
) -> list[TurningPoint]:
    """Turning points of a series of at least this prominence (in its unit), by time; the end where there are none.

    A turning point of the second curve is its extreme of the same kind near that of the first.
    """
    time, points = first.time, []
    for sign in (1.0, -1.0):
        for row in find_peaks(sign * first[name], prominence=prominence)[0]:
            nearby = np.flatnonzero(np.abs(time - time[row]) <= TURN_WINDOW)
            other_row = nearby[np.argmax(sign * second[name][nearby])]
            mean_time = 0.5 * float(time[row] + time[other_row])
            points.append(TurningPoint(mean_time, float(first[name][row]), float(second[name][other_row])))
    if not points:
        return [TurningPoint(float(time[-1]), float(first[name][-1]), float(second[name][-1]))]
    return sorted(points, key=lambda point: point.time)


def mean_reduction(before: SimulationRecord, after: SimulationRecord, name: str) -> float:
    """Reduction of the mean absolute value of a series, in %."""
    return 100.0 * (1.0 - float(np.mean(np.abs(after[name])) / np.mean(np.abs(before[name]))))


def dominant_frequency(time: Array, series: Array) -> float:
    """Dominant frequency in Hz of a series (N,) at even times (s): its spectral peak after polynomial detrending.

    Only frequencies with four periods or more in the series count.
    """
    centred = 2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0
    drift = np.polynomial.chebyshev.chebfit(centred, series, DRIFT_POLYNOMIAL_ORDER)
    detrended = series - np.polynomial.chebyshev.chebval(centred, drift)
    count = ZERO_PADDING_FACTOR * len(detrended)
    spectrum = np.abs(np.fft.rfft(detrended * hann(len(detrended)), count))
    frequency = np.fft.rfftfreq(count, time[1] - time[0])
    spectrum[frequency < MIN_PERIODS / (time[-1] - time[0])] = 0.0
    return float(frequency[np.argmax(spectrum)])


def amplitude(time: Array, series: Array, frequency: float, start: float, end: float) -> float:
    """Least-squares amplitude of an oscillation of known frequency (Hz) between two times (s), on a quadratic drift."""
    inside = (time >= start) & (time <= end)
    phase = 2.0 * np.pi * frequency * time[inside]
    regressors = np.column_stack([np.vander(time[inside] - start, 3), np.cos(phase), np.sin(phase)])
    coefficients = np.linalg.lstsq(regressors, series[inside], rcond=None)[0]
    return float(np.hypot(coefficients[3], coefficients[4]))
