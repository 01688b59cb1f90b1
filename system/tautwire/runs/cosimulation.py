"""A robot's FMUs wired together: cables and platform, driven by winch speeds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ..array_arguments import array_of, rising_of
from ..errors import TautwireError
from ..fmus.packaging import RobotFmus
from ..fmus.slots import SlotError, lacking_ports, require_steps
from ..interrupt import interrupts_held
from ..master import (
    Account,
    AdaptiveStep,
    Component,
    ComponentError,
    Connection,
    Coupling,
    FixedStep,
    Journal,
    Kept,
    Port,
    Progress,
    Recorder,
    Sampled,
    Source,
    Stepping,
    WatchedComponent,
    simulate,
    simulate_watched,
)
from .asked import require_fmus, require_options
from .wiring import AXES, PLATFORM, SHOWN_OF_CABLE, RobotWiring, result_columns, wired_beside, wiring_of

Array = NDArray[np.float64]

STEP = 0.01
SAME_START = 1e-6  # m
SAME_STEP = 1e-6

SPEEDS = "finite speeds in m/s, a row for each time and a column for each of the {count} cables"
TIMES = "rising, finite times (N,) in s, two or more"


@dataclass(frozen=True)
class Motion:
    """A run of a robot with n cables at N times; SI units.

    ``account`` tells steps, redos and the energy that the coupling made. ``time`` (N,); ``position`` and ``velocity``
    (N, 3); ``tension``, ``length``, ``elongation`` and ``strain``
    (N, n). ``elongation`` is the paper's r, see :func:`tautwire_fmu.laws.cable.reading`. ``winch_speed`` (N,) is what
    the winch of a cable, counted from 1, made of its command, where it has one. Columns of a result file that some
    FMU does not show are ``lacking``, their numbers not finite.
    """

    time: Array
    position: Array
    velocity: Array
    tension: Array
    length: Array
    elongation: Array
    strain: Array
    account: Account = field(default_factory=Account, compare=False)
    winch_speed: Mapping[int, Array] = field(default_factory=dict)
    lacking: tuple[str, ...] = ()

    def measured(self) -> Array:
        """What sensors see, shape (N, 3 + n): x, y, z, then the tensions."""
        return np.hstack([self.position, self.tension])

    def frame(self) -> pd.DataFrame:
        """The run as a table with the columns of a result file."""
        cables = [getattr(self, name) for name in SHOWN_OF_CABLE]
        rows = np.column_stack([self.time, self.position, self.velocity, *cables, *self.winch_speed.values()])
        columns = result_columns(self.tension.shape[1], tuple(self.winch_speed))
        return pd.DataFrame(rows, columns=[column.name for column in columns]).drop(columns=list(self.lacking))


class RunError(TautwireError):
    """An FMU failed in a run; ``motion`` is the run until then."""

    def __init__(self, cause: ComponentError, motion: Motion) -> None:
        self.cause = cause
        self.motion = motion
        super().__init__(str(cause))


@dataclass(frozen=True)
class Beside:
    """What runs beside a robot's own FMUs: ``parts`` by name, such as a controller, and ``wires`` from and to them.

    ``also`` are inputs to be driven beside those of the winches; what drives them comes after these.
    """

    parts: Mapping[str, Path] = field(default_factory=dict)
    wires: tuple[Connection, ...] = ()
    also: tuple[Port, ...] = ()


ALONE = Beside()


@contextmanager
def instantiated(
    fmus: RobotFmus, journal: Journal | None = None, also: Sequence[Port] = (), beside: Beside = ALONE
) -> Iterator[Coupling]:
    """The wired robot in initialization mode; instances and folders go when the block ends.

    With a ``journal`` each call of an FMU is noted in it; ``also`` are inputs to be driven beside those of the winches.
    """
    wiring = wired_beside(wired(fmus), len(fmus.cables), beside.wires, (*beside.also, *also))
    make = Component if journal is None else partial(WatchedComponent, journal)
    memory = None if journal is None else journal.inputs
    with ExitStack() as stack:
        components = {
            name: stack.enter_context(make(name, path)) for name, path in {**fmus.parts, **beside.parts}.items()
        }
        for name, component in components.items():
            start = {**fmus.own.get(name, {}), **fmus.settings.get(name, {})}
            component.initialize(0.0, {key: value for key, value in start.items() if _is_parameter(component, key)})
        _require_start(fmus, components[PLATFORM])
        yield Coupling(
            components,
            wiring.connections,
            wiring.drives,
            wiring.bonds,
            wiring.kinks,
            memory=memory,
            rates=wiring.rates,
        )


def _is_parameter(component: Component, name: str) -> bool:
    return name in component.variables and component.variables[name].causality == "parameter"


def _require_start(fmus: RobotFmus, platform: Component) -> None:
    """Refuse a user's platform that is elsewhere than where the cables take it to start."""
    if PLATFORM not in fmus.own:
        return
    block = platform.block([f"position.{axis}" for axis in AXES])
    platform.read(block)
    expected = np.array([fmus.own[PLATFORM][f"start.{axis}"] for axis in AXES])
    if not np.max(np.abs(block.values - expected)) < SAME_START:
        there, here = (", ".join(f"{value:.9g}" for value in place) for place in (block.values, expected))
        mend = "start it there, or give it parameters start.x, start.y and start.z, which are then set"
        raise SlotError(fmus.platform, PLATFORM, None, f"it starts at {there} m, the run at {here} m", mend)


def wired(fmus: RobotFmus) -> RobotWiring:
    """How a robot's FMUs are wired; raises SlotError where one of the user's cannot be read."""
    count = len(fmus.cables)
    own = {slot: fmus.parts[slot] for slot in fmus.own}
    return wiring_of(count, fmus.winch_numbers, lacking_ports(own, count), fmus.measured)


def cosimulate(
    fmus: RobotFmus,
    time: ArrayLike,
    winch_speed: ArrayLike,
    step: float = STEP,
    tolerance: float | None = None,
    progress: Progress | None = None,
    patience: float | None = None,
) -> Motion:
    """Co-simulate a robot over sampled winch speeds, linear between samples.

    ``time`` (N,) in s, rising, and ``winch_speed`` (N, n) in m/s, positive reels in, are arrays or columns of a frame.
    Speeds are what the rope does, or what winches are asked for where the robot has such. Macro steps are no longer
    than ``step`` (s); or such that their estimated errors of all lengths sum to at most ``tolerance`` (m), where one is
    given. ``progress`` gets the share that is done. With a ``patience`` (s) an FMU that is in one call for so long, or
    takes its process down, is one that fails. Returns the run at ``time``: arrays (N, 3) and (N, n) in SI units.

    Raises RunError where an FMU fails, StepError where no step meets the tolerance, SlotError where an FMU of the
    user's starts elsewhere or cannot make such steps, ArgumentError where an argument is none of these.
    """
    require_fmus("cosimulate: fmus", fmus)
    moments = rising_of("cosimulate: time", time, TIMES)
    count = len(fmus.cables)
    speeds = array_of("cosimulate: winch_speed", winch_speed, (len(moments), count), SPEEDS.format(count=count))
    require_options("cosimulate", step, tolerance, progress, patience)
    return run(fmus, Sampled(moments, speeds), moments, stepping_by(step, tolerance, moments), progress, patience)


def stepping_by(step: float, tolerance: float | None, time: Array) -> Stepping:
    """Steps no longer than ``step`` (s), or by a ``tolerance`` (m) for a run over ``time`` where one is given."""
    return FixedStep(step) if tolerance is None else AdaptiveStep(tolerance, float(time[-1] - time[0]))


def run(
    fmus: RobotFmus,
    source: Source,
    time: Array,
    stepping: Stepping,
    progress: Progress | None = None,
    patience: float | None = None,
    beside: Beside = ALONE,
) -> Motion:
    """Co-simulate a robot under any source of winch speeds, recorded at ``time``.

    ``patience`` and ``beside`` are as for :func:`record`.

    Raises RunError, which has the run until then, where an FMU fails.
    """
    wiring = wired(fmus)
    kept = Kept(len(time), len(wiring.shown))
    try:
        account = record(fmus, source, time, stepping, kept, progress, patience, beside)
    except ComponentError as error:
        raise RunError(error, motion_of(time[: kept.count], kept.rows, fmus, wiring)) from error
    return replace(motion_of(time, kept.rows, fmus, wiring), account=account)


def record(
    fmus: RobotFmus,
    source: Source,
    time: Array,
    stepping: Stepping,
    recorder: Recorder,
    progress: Progress | None = None,
    patience: float | None = None,
    beside: Beside = ALONE,
) -> Account:
    """Co-simulate a robot under any source of winch speeds; the recorder gets a row at each ``time`` and keeps it.

    A row is in the order of :attr:`RobotWiring.shown`. Nothing else is kept of a run, however long. With a ``patience``
    (s) the FMUs run in a process of their own, so that one that hangs for so long, or takes its process down, is an FMU
    that fails; see :func:`tautwire.master.simulate_watched`. Other components may run ``beside`` the robot's own.

    Raises ComponentError where an FMU fails; the recorder has what came before. Raises SlotError where an FMU of the
    user's starts elsewhere, or cannot make such steps.
    """
    chosen, intervals = isinstance(stepping, AdaptiveStep), np.diff(time)
    even = not chosen and bool(np.ptp(intervals) <= SAME_STEP * np.max(intervals))
    require_steps({slot: fmus.parts[slot] for slot in fmus.own}, chosen, even)
    wiring = wired_beside(wired(fmus), len(fmus.cables), beside.wires, beside.also)
    ports, source = wiring.shown, Chosen(source, wiring.driven)
    if patience is not None:
        return simulate_watched(
            partial(instantiated, fmus, beside=beside), source, time, ports, stepping, recorder, progress, patience
        )
    with interrupts_held() as raise_interrupt, instantiated(fmus, beside=beside) as coupling:

        def tell(done: float) -> None:
            raise_interrupt()
            if progress is not None:
                progress(done)

        simulate(coupling, source, time, ports, stepping, recorder, tell)
        return coupling.account


@dataclass(frozen=True)
class Chosen:
    """A source of which only the values at ``places`` drive something."""

    source: Source
    places: tuple[int, ...]

    def interval(self, index: int, time: float, step: float, shown: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.master.Source`."""
        start, end = self.source.interval(index, time, step, shown)
        if len(start) == len(self.places):
            return start, end
        places = list(self.places)
        return start[places], end[places]


def motion_of(time: Array, shown: Array, fmus: RobotFmus, wiring: RobotWiring) -> Motion:
    """Sort recorded columns, in the order of :attr:`RobotWiring.shown`, into a run."""
    count, winches = len(fmus.cables), fmus.winch_numbers
    whole = np.full((len(shown), len(wiring.recorded) + len(wiring.unrecorded)), np.nan)
    whole[:, wiring.recorded] = shown
    first_winch = 6 + len(SHOWN_OF_CABLE) * count
    tension, length, elongation, strain = np.split(whole[:, 6:first_winch], len(SHOWN_OF_CABLE), axis=1)
    return Motion(
        time,
        whole[:, :3],
        whole[:, 3:6],
        tension,
        length,
        elongation,
        strain,
        winch_speed=dict(zip(winches, whole[:, first_winch:].T, strict=True)),
        lacking=wiring.unrecorded,
    )
