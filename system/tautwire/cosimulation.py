"""A robot's FMUs wired together: cables and platform, driven by winch speeds."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .errors import TautwireError
from .interrupt import interrupts_held
from .master import (
    Account,
    AdaptiveStep,
    Bond,
    Component,
    ComponentError,
    Connection,
    Coupling,
    FixedStep,
    Kept,
    Port,
    Progress,
    Sampled,
    Source,
    Stepping,
    simulate,
)
from .packaging import RobotFmus

Array = NDArray[np.float64]

AXES = ("x", "y", "z")
PLATFORM = "platform"
STEP = 0.01
SHOWN_OF_CABLE = ("tension", "length", "elongation", "strain")


@dataclass(frozen=True)
class Motion:
    """A run of a robot with n cables at N times; SI units.

    ``account`` tells steps, redos and the energy that the coupling made. ``time`` (N,); ``position`` and ``velocity``
    (N, 3); ``tension``, ``length``, ``elongation`` and ``strain``
    (N, n). ``elongation`` is the paper's r, see :func:`tautwire_fmu.laws.cable.reading`.
    """

    time: Array
    position: Array
    velocity: Array
    tension: Array
    length: Array
    elongation: Array
    strain: Array
    account: Account = field(default_factory=Account, compare=False)

    def measured(self) -> Array:
        """What sensors see, shape (N, 3 + n): x, y, z, then the tensions."""
        return np.hstack([self.position, self.tension])

    def frame(self) -> pd.DataFrame:
        """The run as a table with the columns of a result file."""
        columns: dict[str, Array] = {"time": self.time}
        columns |= dict(zip(AXES, self.position.T, strict=True))
        columns |= {f"v{axis}": speed for axis, speed in zip(AXES, self.velocity.T, strict=True)}
        for name in SHOWN_OF_CABLE:
            columns |= {f"{name}_{i + 1}": row for i, row in enumerate(getattr(self, name).T)}
        return pd.DataFrame(columns)


class RunError(TautwireError):
    """An FMU failed in a run; ``motion`` is the run until then."""

    def __init__(self, cause: ComponentError, motion: Motion) -> None:
        self.cause = cause
        self.motion = motion
        super().__init__(str(cause))


def cable_name(index: int) -> str:
    """The component that holds cable ``index``, counted from 1."""
    return f"cable_{index}"


def connections(cable_count: int) -> list[Connection]:
    """Platform motion to every cable, every cable's force to the platform, each with its rates."""
    shared = [f"{name}.{axis}" for axis in AXES for name in ("position", "velocity", "acceleration")]
    own = [(name, axis) for axis in AXES for name in ("force", "force_rate")]
    wires: list[Connection] = []
    for index in range(1, cable_count + 1):
        cable = cable_name(index)
        wires += [_wire(PLATFORM, name, cable, name) for name in shared]
        wires += [_wire(cable, f"{name}.{axis}", PLATFORM, f"{name}_{index}.{axis}") for name, axis in own]
    return wires


def _wire(source: str, output: str, target: str, variable: str) -> Connection:
    return Connection(Port(source, output), Port(target, variable))


def winch_ports(cable_count: int) -> list[Port]:
    """The driven inputs: winch speed and acceleration of each cable."""
    return [
        Port(cable_name(index), variable)
        for index in range(1, cable_count + 1)
        for variable in ("winch_speed", "winch_acceleration")
    ]


def shown_ports(cable_count: int) -> list[Port]:
    """What a run records, in the order of :class:`Motion`."""
    platform = [Port(PLATFORM, f"{name}.{axis}") for name in ("position", "velocity") for axis in AXES]
    cables = [Port(cable_name(index), name) for name in SHOWN_OF_CABLE for index in range(1, cable_count + 1)]
    return platform + cables


def bonds(cable_count: int) -> list[Bond]:
    """The power that each cable and the platform exchange, axis by axis."""
    return [
        Bond(
            effort=_wire(cable_name(index), f"force.{axis}", PLATFORM, f"force_{index}.{axis}"),
            flow=_wire(PLATFORM, f"velocity.{axis}", cable_name(index), f"velocity.{axis}"),
        )
        for index in range(1, cable_count + 1)
        for axis in AXES
    ]


def kinks(cable_count: int) -> list[Port]:
    """Outputs at whose sign changes forces have a kink: a cable goes slack, or tight."""
    return [Port(cable_name(index), "pull") for index in range(1, cable_count + 1)]


@contextmanager
def instantiated(fmus: RobotFmus) -> Iterator[Coupling]:
    """The wired robot in initialization mode; instances and folders go when the block ends."""
    count = len(fmus.cables)
    with ExitStack() as stack:
        components = {
            name: stack.enter_context(Component(name, path))
            for name, path in [
                (PLATFORM, fmus.platform),
                *((cable_name(i), path) for i, path in enumerate(fmus.cables, start=1)),
            ]
        }
        for component in components.values():
            component.initialize(0.0, {})
        yield Coupling(components, connections(count), winch_ports(count), bonds(count), kinks(count))


def cosimulate(
    fmus: RobotFmus,
    time: Array,
    winch_speed: Array,
    step: float = STEP,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> Motion:
    """Co-simulate a robot over sampled winch speeds, linear between samples.

    ``time`` (N,) in s, rising; ``winch_speed`` (N, n) in m/s, positive reels in. Macro steps are no longer than
    ``step`` (s); or such that their estimated errors of all lengths sum to at most ``tolerance`` (m), where one is
    given. Returns the run at ``time``.

    Raises RunError where an FMU fails, StepError where no step meets the tolerance.
    """
    stepping: Stepping = FixedStep(step)
    if tolerance is not None:
        stepping = AdaptiveStep(tolerance, float(time[-1] - time[0]))
    return run(fmus, Sampled(time, winch_speed), time, stepping, progress)


def run(fmus: RobotFmus, source: Source, time: Array, stepping: Stepping, progress: Progress | None = None) -> Motion:
    """Co-simulate a robot under any source of winch speeds, recorded at ``time``.

    Raises RunError, which has the run until then, where an FMU fails.
    """
    count = len(fmus.cables)
    ports = shown_ports(count)
    kept = Kept(len(time), len(ports))
    with interrupts_held() as raise_interrupt, instantiated(fmus) as coupling:

        def tell(done: float) -> None:
            raise_interrupt()
            if progress is not None:
                progress(done)

        try:
            simulate(coupling, source, time, ports, stepping, kept, tell)
        except ComponentError as error:
            raise RunError(error, motion_of(time[: kept.count], kept.rows)) from error
        return replace(motion_of(time, kept.rows), account=coupling.account)


def motion_of(time: Array, shown: Array) -> Motion:
    """Sort recorded columns, in the order of :func:`shown_ports`, into a run."""
    tension, length, elongation, strain = np.split(shown[:, 6:], len(SHOWN_OF_CABLE), axis=1)
    return Motion(time, shown[:, :3], shown[:, 3:6], tension, length, elongation, strain)
