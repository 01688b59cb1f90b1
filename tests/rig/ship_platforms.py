"""Remakes the recordings of shipped robots whose platform turns: python -m tests.rig.ship_platforms.

A rigid body on straight ropes of the logarithmic law, by Newton and Euler. State: centre of mass x, its velocity v, the
rotation matrix R by its nine entries, the angular velocity w in the platform's axes, and what each winch wound in:

    m dv/dt = sum T_i u_i - m g e_z,   dR/dt = R [w],   I dw/dt = R' sum (b_i - x) x T_i u_i - w x I w
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from tests.rig.record import write_recording
from tests.rig.ship import EXAMPLES

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

Vector = NDArray[np.float64]

SLOW_TONES, FAST_TONES = 3, 4
RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE = 1e-10, 1e-12


@dataclass(frozen=True)
class Shipment:
    """How the two recordings of one example are made.

    `reach` in m and `turn` in rad bound the slow motion, with periods between `slow` (s); the fast tones lie between
    `fast` (Hz), each with an acceleration near `shake` (m/s^2) and `twist` (rad/s^2). What the robot file does not say:
    a payload of `payload` kg at the point `carried_at` (m, in the platform's frame), a centre of mass `shifted` by m,
    and ropes of `damping` times the declared one.
    """

    name: str
    seeds: Mapping[str, int]
    duration: float
    rate: float
    reach: float
    turn: float
    slow: tuple[float, float]
    fast: tuple[float, float]
    shake: float
    twist: float
    payload: float = 0.0
    carried_at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shifted: tuple[float, float, float] = (0.0, 0.0, 0.0)
    damping: float = 1.0


SHIPMENTS = (
    Shipment(
        name="cogiro",
        seeds={"fit": 41, "check": 42},
        duration=12.0,
        rate=50.0,
        reach=0.5,
        turn=0.06,
        slow=(4.0, 9.0),
        fast=(1.5, 9.0),
        shake=0.25,
        twist=0.5,
        payload=5.0,
        carried_at=(0.4, 0.3, 1.0),
    ),
    Shipment(
        name="caroca8",
        seeds={"fit": 51, "check": 52},
        duration=12.0,
        rate=50.0,
        reach=0.3,
        turn=0.06,
        slow=(3.0, 7.0),
        fast=(2.0, 12.0),
        shake=0.25,
        twist=0.5,
        shifted=(0.02, -0.015, 0.0),
    ),
    Shipment(
        name="fast",
        seeds={"fit": 61, "check": 62},
        duration=30.0,
        rate=20.0,
        reach=5.0,
        turn=0.01,
        slow=(15.0, 40.0),
        fast=(0.2, 4.0),
        shake=0.02,
        twist=0.01,
        damping=3.0,
    ),
    Shipment(
        name="ipanema",
        seeds={"fit": 71, "check": 72},
        duration=12.0,
        rate=50.0,
        reach=0.2,
        turn=0.06,
        slow=(3.0, 7.0),
        fast=(1.5, 12.0),
        shake=0.3,
        twist=0.1,
    ),
)


@dataclass(frozen=True)
class Body:
    """The platform as it truly is, and its ropes: one row or entry per cable, SI units."""

    mass: float
    inertia: Vector
    centre: Vector
    start: Vector
    gravity: float
    anchors: Vector
    attachments: Vector
    axial: Vector
    viscous: Vector
    start_tensions: Vector


def true_body(content: Mapping[str, Any], shipment: Shipment) -> Body:
    """The body of a robot file with what that does not say; level at its start, in equilibrium."""
    platform, cables = content["platform"], content["cable"]
    declared, mass = float(platform["mass"]), float(platform["mass"]) + shipment.payload
    own_centre = np.array(platform.get("centre_of_mass", (0.0, 0.0, 0.0)), float) + shipment.shifted
    load = np.array(shipment.carried_at, float)
    centre = (declared * own_centre + shipment.payload * load) / mass
    inertia = np.array(platform["inertia"], float)
    for part, at in ((declared, own_centre), (shipment.payload, load)):
        arm = at - centre
        inertia = inertia + part * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    columns = {key: np.array([cable[key] for cable in cables], float) for key in ("anchor", "attachment")}
    axial, viscous = (np.array([cable[key] * cable["area"] for cable in cables]) for key in ("modulus", "damping"))
    start, gravity = np.array(platform["start"], float), float(content["gravity"])
    span = columns["anchor"] - start - columns["attachment"]
    direction = span / np.linalg.norm(span, axis=1)[:, None]
    wrenches = np.hstack([direction, np.cross(columns["attachment"], direction)]).T
    weight = np.array([0.0, 0.0, mass * gravity])
    preferred = np.full(len(cables), float(content["tension"]["preferred"]))
    needed = np.concatenate([weight, np.cross(centre, weight)]) - wrenches @ preferred
    tensions = preferred + np.linalg.pinv(wrenches) @ needed
    assert tensions.min() > content["tension"]["minimum"] or len(cables) == 6, "a bound would count"
    return Body(
        mass=mass,
        inertia=inertia,
        centre=centre,
        start=start,
        gravity=gravity,
        anchors=columns["anchor"],
        attachments=columns["attachment"],
        axial=axial,
        viscous=shipment.damping * viscous,
        start_tensions=tensions,
    )


@dataclass(frozen=True)
class TonePath:
    """Tones of position (m) and rotation vector (rad), risen smoothly from rest within `rise` s."""

    amplitudes: Vector
    angular: Vector
    phases: Vector
    rise: float

    def pose(self, time: float) -> tuple[Vector, Vector]:
        """Displacement from the start, and rotation vector."""
        tones = np.sin(self.angular[:, None] * time + self.phases) - np.sin(self.phases)
        values = (1.0 - np.exp(-((time / self.rise) ** 3))) * np.sum(self.amplitudes * tones, axis=0)
        return values[:3], values[3:]


def planned_path(shipment: Shipment, seed: int) -> TonePath:
    """A path with slow tones of large reach, and fast ones that shake the ropes."""
    random = np.random.default_rng(seed)
    slow = 2.0 * np.pi / random.uniform(*shipment.slow, SLOW_TONES)
    low, high = np.log(shipment.fast)
    fast = 2.0 * np.pi * np.exp(np.linspace(low, high, FAST_TONES) + random.uniform(-0.1, 0.1, FAST_TONES))
    sizes = np.repeat([[shipment.reach, shipment.turn]], 3, axis=1) / SLOW_TONES
    shakes = np.repeat([[shipment.shake, shipment.twist]], 3, axis=1) / fast[:, None] ** 2
    signs = random.uniform(0.5, 1.0, (SLOW_TONES + FAST_TONES, 6)) * random.choice([-1.0, 1.0], (7, 6))
    amplitudes = signs * np.vstack([np.repeat(sizes, SLOW_TONES, axis=0), shakes])
    phases = random.uniform(0.0, 2.0 * np.pi, amplitudes.shape)
    return TonePath(amplitudes, np.concatenate([slow, fast]), phases, 0.4 * shipment.slow[0])


def lengths_along(body: Body, path: TonePath, time: float) -> Vector:
    """Lengths of inextensible ropes at a pose of the path."""
    shift, turn = path.pose(time)
    points = body.start + shift + body.attachments @ Rotation.from_rotvec(turn).as_matrix().T
    return np.linalg.norm(body.anchors - points, axis=1)


def flight(body: Body, times: Vector, speeds: Vector) -> tuple[Vector, Vector, Vector]:
    """Tensions (N, n), positions of the frame's origin (N, 3) and orientations (N, 4; w first) at the samples.

    Winch speeds (N, n) are linear between samples, where the integration restarts.
    """
    count = len(body.anchors)
    arms = body.attachments - body.centre
    inverse = np.linalg.inv(body.inertia)
    start_lengths = np.linalg.norm(body.anchors - body.start - body.attachments, axis=1)

    def ropes(state: Vector, speed: Vector) -> tuple[Vector, Vector, Vector, Vector]:
        rotation, spin = state[6:15].reshape(3, 3), state[15:18]
        points = arms @ rotation.T
        velocity = state[3:6] + np.cross(rotation @ spin, points)
        span = body.anchors - state[:3] - points
        length = np.linalg.norm(span, axis=1)
        direction = span / length[:, None]
        rate = -np.sum(direction * velocity, axis=1)
        strain = np.log(length / start_lengths) + state[18:]
        tension = body.axial * strain + body.viscous * (rate + speed) / length + body.start_tensions
        return np.maximum(tension, 0.0), direction, points, length

    def rates(time: float, state: Vector, left: int) -> Vector:
        share = (time - times[left]) / (times[left + 1] - times[left])
        speed = (1.0 - share) * speeds[left] + share * speeds[left + 1]
        tension, direction, points, length = ropes(state, speed)
        rotation, spin = state[6:15].reshape(3, 3), state[15:18]
        forces = tension[:, None] * direction
        acceleration = forces.sum(axis=0) / body.mass - np.array([0.0, 0.0, body.gravity])
        moment = rotation.T @ np.cross(points, forces).sum(axis=0) - np.cross(spin, body.inertia @ spin)
        x, y, z = spin
        turning = rotation @ np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        return np.concatenate([state[3:6], acceleration, turning.ravel(), inverse @ moment, speed / length])

    state = np.concatenate([body.start + body.centre, np.zeros(3), np.eye(3).ravel(), np.zeros(3 + count)])
    tensions, positions, orientations = [], [], []
    for row in range(len(times)):
        rotation = state[6:15].reshape(3, 3)
        tensions.append(ropes(state, speeds[row])[0])
        positions.append(state[:3] - rotation @ body.centre)
        x, y, z, w = Rotation.from_matrix(rotation).as_quat()
        orientations.append([w, x, y, z])
        if row + 1 < len(times):
            solution = solve_ivp(
                rates,
                (times[row], times[row + 1]),
                state,
                "DOP853",
                args=(row,),
                rtol=RELATIVE_TOLERANCE,
                atol=ABSOLUTE_TOLERANCE,
            )
            state = solution.y[:, -1]
    return np.array(tensions), np.array(positions), np.array(orientations)


@dataclass(frozen=True)
class Flight:
    """What perfect sensors give, one row per sample; orientations with w first."""

    times: Vector
    speeds: Vector
    tensions: Vector
    positions: Vector
    orientations: Vector


def true_flight(shipment: Shipment, which: str, content: Mapping[str, Any]) -> Flight:
    """The motion of one of the two recordings, `fit` or `check`."""
    body, path = true_body(content, shipment), planned_path(shipment, shipment.seeds[which])
    times = np.arange(round(shipment.duration * shipment.rate) + 1) / shipment.rate
    # A five-point difference, exact to rounding beside the noise.
    step = 1e-3
    weights = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * step)
    nearby = [[lengths_along(body, path, max(time + k * step, 0.0)) for time in times] for k in (-2, -1, 1, 2)]
    speeds = -np.tensordot(weights, np.array(nearby), axes=1)
    speeds[0] = 0.0
    flown = Flight(times, speeds, *flight(body, times, speeds))
    assert flown.tensions.min() > 0.15 * body.start_tensions.min(), "a rope is nearly slack"
    return flown


def declared(shipment: Shipment) -> dict[str, Any]:
    """The content of the shipped robot file."""
    return tomllib.loads((EXAMPLES / shipment.name / "robot.toml").read_text(encoding="utf-8"))


def make(shipment: Shipment, which: str) -> pd.DataFrame:
    """One of the two recordings, with the noise of the robot file's sensors."""
    content = declared(shipment)
    noise, true = content["sensors"], true_flight(shipment, which, content)
    random = np.random.default_rng(shipment.seeds[which] + 1000)

    def noisy(values: Vector, sensor: str) -> Vector:
        return values + random.normal(scale=noise[f"{sensor}_noise"], size=values.shape)

    tilts = Rotation.from_rotvec(noisy(np.zeros_like(true.positions), "orientation"))
    orientations = (tilts * Rotation.from_quat(true.orientations[:, [1, 2, 3, 0]])).as_quat()[:, [3, 0, 1, 2]]
    groups = (
        ("winch_speed_{}", range(1, true.speeds.shape[1] + 1), noisy(true.speeds, "winch_speed")),
        ("tension_{}", range(1, true.speeds.shape[1] + 1), noisy(true.tensions, "tension")),
        ("{}", "xyz", noisy(true.positions, "position")),
        ("q{}", "wxyz", orientations),
    )
    columns = {name.format(part): values[:, k] for name, parts, values in groups for k, part in enumerate(parts)}
    return pd.DataFrame({"time": true.times, **columns})


def main() -> None:
    """Write every shipped recording into its place."""
    for shipment in SHIPMENTS:
        for which in shipment.seeds:
            path = EXAMPLES / shipment.name / f"{which}.csv"
            write_recording(make(shipment, which), path)
            print(f"{shipment.name}/{which}.csv  {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
