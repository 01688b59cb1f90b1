"""Disturbance: what acts on every robot beside white noise, as Ornstein-Uhlenbeck processes.

A random force on the platform along each axis, and errors with a memory of each tracker axis and each load cell; on a
platform that turns also a random moment about each axis, and such errors of its orientation. Each is a state d of the
filter, with standard deviation ``s`` and bandwidth ``f``:

    d(t + h) = e^(-a h) d(t) + w        var w = s^2 (1 - e^(-2 a h))        a = 2 pi f

Source: Gelb (1974), Applied Optimal Estimation, sec. 2.4 and 4.5, on exponentially correlated noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class OrnsteinUhlenbeck:
    """Ornstein-Uhlenbeck process: standard deviation ``rms``, in the unit of what it disturbs, and bandwidth in Hz."""

    rms: float
    bandwidth: float


@dataclass(frozen=True)
class Disturbance:
    """Disturbance of a robot: force on each axis (N), errors with a memory of each position (m) and each tension (N).

    ``position_noise`` (m) and ``tension_noise`` (N) are the standard deviations of the white noise beside them. On a
    platform that turns the moment about each axis is as large as the force at ``moment_arm`` (m), and ``rotation`` and
    ``rotation_noise`` (rad) are those of its orientation; None for a point mass.
    """

    force: OrnsteinUhlenbeck
    position: OrnsteinUhlenbeck
    tension: OrnsteinUhlenbeck
    position_noise: float
    tension_noise: float
    rotation: OrnsteinUhlenbeck | None = None
    rotation_noise: float = 0.0
    moment_arm: float = 1.0

    def sentence(self, has_position: bool, has_tension: bool, has_orientation: bool = False) -> str:
        """In words, without the errors of sensors that the robot does not have."""
        errors = [f"{_described(self.position, 'm')} in positions"] if has_position else []
        errors += [f"{_described(self.tension, 'N')} in tensions"] if has_tension else []
        errors += [f"{_described(self.rotation, 'rad')} in rotations"] if has_orientation and self.rotation else []
        force = f"a random force of {_described(self.force, 'N')} on the platform"
        force += f" (and at {self.moment_arm:.2g} m a moment)" if self.rotation else ""
        sizes = f"{force}, and errors with a memory of {' and of '.join(errors)}"
        return f"beside white noise the model has {sizes}, as the fit recording shows them (rms)"

    def processes(self, cable_count: int) -> tuple[OrnsteinUhlenbeck, ...]:
        """One for each disturbance state: three forces, and three moments, then one for each output."""
        moment = replace(self.force, rms=self.moment_arm * self.force.rms)
        wrench = (*[self.force] * 3, *([moment] * 3 if self.rotation else []))
        rotations = [self.rotation] * 3 if self.rotation else []
        return (*wrench, *[self.position] * 3, *[self.tension] * cable_count, *rotations)

    def white_variances(self, cable_count: int) -> Array:
        """Variances of the white noise of x, y, z, each tension, and each rotation (m,)."""
        rotations = [self.rotation_noise**2] * 3 if self.rotation else []
        return np.array([self.position_noise**2] * 3 + [self.tension_noise**2] * cable_count + rotations)


def sensor_noise_only(
    disturbance: Disturbance, position_noise: float, tension_noise: float, rotation_noise: float | None = None
) -> Disturbance:
    """The disturbance without its force on the platform, its errors no larger than the sensors' noise (m, N, rad).

    What exceeds that is no error of a sensor, but an error of the model that passes for one.
    """
    limits = ((disturbance.force, 0.0), (disturbance.position, position_noise), (disturbance.tension, tension_noise))
    force, position, tension = (replace(process, rms=min(process.rms, limit)) for process, limit in limits)
    rotation = disturbance.rotation
    if rotation is not None and rotation_noise is not None:
        rotation = replace(rotation, rms=min(rotation.rms, rotation_noise))
    return replace(disturbance, force=force, position=position, tension=tension, rotation=rotation)


ABSENT = OrnsteinUhlenbeck(0.0, 1.0)
NEUTRAL = Disturbance(ABSENT, ABSENT, ABSENT, position_noise=1.0, tension_noise=1.0)


def _described(process: OrnsteinUhlenbeck, unit: str) -> str:
    return f"{process.rms:.2g} {unit} (below {process.bandwidth:.2g} Hz)"
