"""Recordings as a real robot would give them: sampled, with sensor noise, in the project's format."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from tests.rig.mechanics import Rig, Settings
from tests.rig.program import Program
from tests.rig.robot import Robot, Vector
from tests.rig.solve import Method, integrate


@dataclass(frozen=True)
class Accuracy:
    """How a recording is integrated."""

    method: Method = "DOP853"
    rtol: float = 1e-10
    atol: float = 1e-12


SMOOTH = Accuracy()
# A high order gains nothing where slopes jump all the time; this errs by some 0.005 N and 0.3 micrometres.
KINKED = Accuracy("RK45", 1e-7, 1e-9)


def make_recording(
    robot: Robot,
    effects: Settings | None,
    program: Program,
    *,
    duration: float,
    rate: float,
    seed: int,
    noise: bool = True,
    accuracy: Accuracy | None = None,
) -> pd.DataFrame:
    """Sample a run at `rate` (Hz); the true program drives the robot, the encoder records it with noise."""
    times = np.arange(round(duration * rate) + 1) / rate
    seen = readings(Rig(robot, effects, program), times, accuracy)
    tension, position, rotation = seen.tension, seen.position, seen.rotation
    speed = np.array([program.speed(float(time)) for time in times])
    if noise:
        random = np.random.default_rng(seed)
        speed = speed + random.normal(scale=robot.noise.winch_speed, size=speed.shape)
        tension = tension + random.normal(scale=robot.noise.tension, size=tension.shape)
        position = position + random.normal(scale=robot.noise.position, size=position.shape)
        if rotation is not None:
            rotation = turned(rotation, random.normal(scale=robot.noise.orientation, size=position.shape))
    columns = {"time": times}
    columns.update({f"winch_speed_{cable + 1}": speed[:, cable] for cable in range(robot.count)})
    columns.update({f"tension_{cable + 1}": tension[:, cable] for cable in range(robot.count)})
    columns.update({axis: position[:, index] for index, axis in enumerate("xyz")})
    if rotation is not None:
        columns.update(quaternion_columns(rotation))
    return pd.DataFrame(columns)


def turned(rotation: Vector, vectors: Vector) -> Vector:
    """Rotation matrices (samples, 3, 3) turned further by rotation vectors (samples, 3) in the world's axes, rad."""
    return np.asarray(Rotation.from_rotvec(vectors).as_matrix() @ rotation, float)


def quaternion_columns(rotation: Vector) -> dict[str, Vector]:
    """The columns qw, qx, qy, qz of rotation matrices (samples, 3, 3); nan where these are."""
    quaternions = np.full((len(rotation), 4), np.nan)
    seen = np.isfinite(rotation).all(axis=(1, 2))
    quaternions[seen] = Rotation.from_matrix(rotation[seen]).as_quat()
    return {f"q{part}": quaternions[:, index] for part, index in (("w", 3), ("x", 0), ("y", 1), ("z", 2))}


@dataclass(frozen=True)
class Readings:
    """What perfect sensors give: load cells (samples, n) in N, position (samples, 3) in m.

    Of a platform that turns also its rotation matrices (samples, 3, 3), which no sensor of the rig shows late.
    """

    tension: Vector
    position: Vector
    rotation: Vector | None = None


def outputs(rig: Rig, times: Vector, accuracy: Accuracy | None = None) -> tuple[Vector, Vector]:
    """Load cells and position of :func:`readings`."""
    seen = readings(rig, times, accuracy)
    return seen.tension, seen.position


def readings(rig: Rig, times: Vector, accuracy: Accuracy | None = None) -> Readings:
    """What perfect sensors give at rising times."""
    lags = lags_of(rig)
    # A lagging sensor shows the start until its lag has passed.
    asked = {lag: np.maximum(times - lag, 0.0) for lag in np.unique(np.concatenate(list(lags.values())))}
    instants = np.unique(np.concatenate([times, *asked.values()] if rig.turning else list(asked.values())))
    if accuracy is None:
        accuracy = KINKED if any(effect.kinked for effect in rig.effects) else SMOOTH
    states = integrate(rig, rig.begin(), instants, accuracy.method, accuracy.rtol, accuracy.atol)
    moments = [rig.evaluate(float(time), state) for time, state in zip(instants, states, strict=True)]
    cells = np.array([moment.cell for moment in moments])
    places = np.array([moment.position for moment in moments])

    def lagged(values: Vector, lag: Vector) -> Vector:
        rows = [np.searchsorted(instants, asked[float(one)]) for one in lag]
        return np.column_stack([values[row, column] for column, row in enumerate(rows)])

    tension, position = lagged(cells, lags["tension"]), lagged(places, lags["position"])
    for effect in rig.effects:
        tension, position = effect.sense(tension, position)
    if not rig.turning:
        return Readings(tension, position)
    return Readings(tension, position, np.array([moments[row].rotation for row in np.searchsorted(instants, times)]))


def lags_of(rig: Rig) -> dict[str, Vector]:
    """By how many seconds `position` (3) and `tension` (n) lag, all effects together."""
    lags = {"position": np.zeros(3), "tension": np.zeros(rig.robot.count)}
    for effect in rig.effects:
        for name, lag in effect.delay().items():
            lags[name] = lags[name] + lag
    return lags


def write_recording(recording: pd.DataFrame, path: str | Path) -> None:
    """Write it as CSV with seven significant digits."""
    recording.to_csv(path, index=False, float_format="%.7g", lineterminator="\n")
