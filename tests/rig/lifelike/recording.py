"""One run of a lifelike robot: what happens, and what its log says of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from tests.rig.effect import Effect
from tests.rig.lifelike.design import Design
from tests.rig.lifelike.little import Little
from tests.rig.lifelike.march import TabulatedProgram, march, steps_for
from tests.rig.lifelike.sensors import Memory, counted, differentiated, drifting, noisy, tracked
from tests.rig.lifelike.surroundings import played
from tests.rig.lifelike.survey import Survey, Truth
from tests.rig.mechanics import Rig, Settings
from tests.rig.record import lags_of, quaternion_columns, turned
from tests.rig.robot import Vector

# A drum leaves a backlash within some hundredths of a second, not at once.
MEETING = 0.01
LONGEST_STEP = 0.005


@dataclass(frozen=True)
class Lot:
    """A robot as declared and as it is, and its little things."""

    design: Design
    survey: Survey
    truth: Truth
    little: Little


@dataclass(frozen=True)
class Outputs:
    """What perfect sensors would give at each sample: load cells (N) and position (m).

    Of a platform that turns also rotation matrices (samples, 3, 3), and its `size`, by which angles count as m.
    """

    tension: Vector
    position: Vector
    rotation: Vector | None = None
    size: float = 0.0

    def apart(self, other: Outputs) -> tuple[float, float]:
        """Root mean square of the difference, over samples and components: (position in m, tension in N)."""
        turned = 0.0
        if self.rotation is not None and other.rotation is not None:
            difference = Rotation.from_matrix(self.rotation) * Rotation.from_matrix(other.rotation).inv()
            turned = self.size**2 * float(np.mean(difference.as_rotvec() ** 2))
        return (
            float(np.sqrt(np.mean((self.position - other.position) ** 2) + turned)),
            float(np.sqrt(np.mean((self.tension - other.tension) ** 2))),
        )


@dataclass(frozen=True)
class Session:
    """One motion of one robot: `seed` of its program, its surroundings and its noise; `duration` in s, `rate` in Hz."""

    lot: Lot
    seed: int
    duration: float
    rate: float

    @property
    def interval(self) -> float:
        """Between samples, s."""
        return 1.0 / self.rate

    @cached_property
    def substeps(self) -> int:
        """Steps of the integration between samples."""
        return max(steps_for(self.lot.design.robot, self.interval), int(np.ceil(self.interval / LONGEST_STEP)))

    @property
    def half_step(self) -> float:
        """Of the tables, s."""
        return 0.5 * self.interval / self.substeps

    @property
    def samples(self) -> int:
        """How many rows the recording has."""
        return round(self.duration * self.rate) + 1

    @cached_property
    def motor(self) -> TabulatedProgram:
        """What the motors do."""
        program = self.lot.design.program(self.seed)
        rows = 2 * self.substeps * (self.samples - 1) + 1
        times = [row * self.half_step for row in range(rows)]
        speeds = np.array([program.speed(time) for time in times])
        return TabulatedProgram(self.half_step, speeds, np.array([program.travel(time) for time in times]))

    @cached_property
    def drum(self) -> TabulatedProgram:
        """What the drums do behind the backlash."""
        gap = self.lot.little.backlash
        if not gap:
            return self.motor
        width = MEETING / self.half_step
        beyond = int(np.ceil(4.0 * width))
        # Mirrored in their ends, so that drums do not stop where the recording does.
        longer = np.pad(played(self.motor.travels, gap), ((beyond, beyond), (0, 0)), "reflect", reflect_type="odd")
        followed = gaussian_filter1d(longer, width, axis=0)[beyond:-beyond]
        return TabulatedProgram(self.half_step, np.gradient(followed, self.half_step, axis=0), followed)

    def random(self, stream: int) -> np.random.Generator:
        """Chance of this session for one purpose."""
        return np.random.default_rng([self.seed, stream])

    def outputs(self, hidden: Settings, little: bool = True) -> Outputs:
        """What happens with something hidden, with or without the little things (the robot is the true one)."""
        rows = len(self.motor.speeds)
        settings = {**(self.lot.little.settings if little else {}), **hidden}
        around: list[Effect] = []
        if little:
            around = self.lot.little.surroundings(self.random(1), self.lot.design, self.half_step, rows)
        rig = Rig(self.lot.truth.robot, settings, self.drum if little else self.motor, around)
        step = 2.0 * self.half_step
        cells, places, rotations = march(rig, step, self.substeps * (self.samples - 1))
        fine = np.arange(len(cells)) * step
        times, lags = np.arange(self.samples) * self.interval, lags_of(rig)
        tension, position = _late(fine, cells, times, lags["tension"]), _late(fine, places, times, lags["position"])
        for effect in rig.effects:
            tension, position = effect.sense(tension, position)
        rotation = None if rotations is None else rotations[:: self.substeps]
        return Outputs(tension, position, rotation, self.lot.design.size)

    def log(self, outputs: Outputs) -> pd.DataFrame:
        """What the log says: sensors with their faults and noise."""
        lot, noise = self.lot, self.lot.design.robot.noise
        random = self.random(2)
        tension = outputs.tension * lot.truth.gain + lot.truth.offset
        tension = tension + drifting(random, tension.shape, lot.little.cell_drift)
        tension = noisy(random, tension, self.interval, noise.tension, lot.little.cell)
        position = noisy(random, outputs.position + lot.truth.position, self.interval, noise.position, lot.little.place)
        position = tracked(random, position, self.interval, lot.little.tracker)
        columns = {"time": np.arange(self.samples) / self.rate, **self._winches(random)}
        columns.update({f"tension_{index + 1}": column for index, column in enumerate(tension.T)})
        unseen = "y" if lot.design.planar and lot.little.blind else ""
        columns.update({axis: position[:, index] for index, axis in enumerate("xyz") if axis != unseen})
        if outputs.rotation is not None:
            columns.update(quaternion_columns(self._seen(random, outputs.rotation, position)))
        return pd.DataFrame(columns)

    def _seen(self, random: np.random.Generator, rotation: Vector, position: Vector) -> Vector:
        """Rotation matrices as the tracker shows them; missing where the position is."""
        noise, little = self.lot.design.robot.noise, self.lot.little
        # The tracker's noise with a memory is as large beside the white one in angles as it is in positions.
        memory = Memory(little.place.rms * noise.orientation / noise.position, little.place.bandwidth)
        errors = noisy(random, np.zeros_like(position), self.interval, noise.orientation, memory)
        shown = turned(rotation, errors)
        shown[np.isnan(position).any(axis=1)] = np.nan
        return shown

    def _winches(self, random: np.random.Generator) -> dict[str, Vector]:
        """Speeds, or lengths, or both."""
        little, every = self.lot.little, 2 * self.substeps
        travel, speed = self.motor.travels[::every], self.motor.speeds[::every]
        zero = random.uniform(0.5, 2.5, travel.shape[1])
        if little.counts:
            travel = counted(travel, little.counts)
            speed = differentiated(travel, self.interval)
        else:
            speed = speed + random.normal(scale=self.lot.design.robot.noise.winch_speed, size=speed.shape)
        columns: dict[str, Vector] = {}
        if little.lengths != "lengths":
            columns.update({f"winch_speed_{index + 1}": column for index, column in enumerate(speed.T)})
        if little.lengths != "speeds":
            columns.update({f"rope_length_{index + 1}": column for index, column in enumerate((zero - travel).T)})
        return columns


def _late(fine: np.ndarray, values: Vector, times: np.ndarray, lags: Vector) -> Vector:
    """Each column at the samples, as long ago as its sensor lags; a lagging one shows the start until then."""
    if not lags.any():
        every = round((len(fine) - 1) / (len(times) - 1))
        return values[::every]
    columns = [
        CubicSpline(fine, column)(np.maximum(times - lag, 0.0)) for column, lag in zip(values.T, lags, strict=True)
    ]
    return np.column_stack(columns)
