"""The declared robot: platform, cables, winch, sensors, effects and formulas as immutable data."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from ..validation import validate_instance

Point = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
AXES = ("x", "y", "z")
QUATERNION_COLUMNS = ("qw", "qx", "qy", "qz")

# Components that exist once per cable: an effect in them may apply to some cables only.
PER_CABLE_COMPONENTS = ("cable", "winch", "sensor")


class Numbers(Mapping[str, float]):
    """An immutable, hashable mapping of names to numbers; equality ignores the order."""

    __slots__ = ("_items",)

    def __init__(self, numbers: Mapping[str, float]) -> None:
        self._items = tuple(numbers.items())

    def __getitem__(self, name: str) -> float:
        for known, number in self._items:
            if known == name:
                return number
        raise KeyError(name)

    def __iter__(self) -> Iterator[str]:
        return (name for name, _ in self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __hash__(self) -> int:
        return hash(frozenset(self._items))

    def __repr__(self) -> str:
        return f"Numbers({dict(self._items)})"


@dataclass(frozen=True)
class Platform:
    """The platform: a rigid body where it has an ``inertia``, else a point mass; ``mass`` in kg.

    ``start`` is where a run starts at rest, in m: the origin of the platform's frame, turned from the world's by the
    unit quaternion ``start_orientation`` (w, x, y, z; platform to world). ``inertia`` in kg m^2, by rows, is about the
    ``centre_of_mass`` (m) and along the platform's axes. Standard deviations of the true values: ``mass_uncertainty``
    (kg), ``inertia_uncertainty`` of each principal moment (kg m^2), ``centre_of_mass_uncertainty`` of each coordinate
    (m).
    """

    mass: float
    start: Point
    mass_uncertainty: float = 0.0
    inertia: tuple[Point, Point, Point] | None = None
    centre_of_mass: Point = (0.0, 0.0, 0.0)
    start_orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    inertia_uncertainty: float = 0.0
    centre_of_mass_uncertainty: float = 0.0

    @property
    def is_rigid_body(self) -> bool:
        """Whether the platform turns: a point mass does not."""
        return self.inertia is not None


@dataclass(frozen=True)
class TensionLimits:
    """Bounds and preferred value of the tension distribution, in N; used with more cables than degrees of freedom.

    ``preferred_uncertainty``: standard deviation of the true start tensions from those of the distribution.
    """

    minimum: float
    maximum: float
    preferred: float
    preferred_uncertainty: float | None = None


@dataclass(frozen=True)
class Sensors:
    """Sensor noise, standard deviation of a sample: position in m, tension in N, winch speed in m/s; None if unknown.

    ``orientation_noise``, in rad, is that of a rigid platform's rotation about each axis.
    ``tension_offset_uncertainty`` (N) and ``position_offset_uncertainty`` (m): standard deviations of the constant
    offset of each load cell, and of the tracker on each axis; ``tension_gain_uncertainty``, that of each load cell's
    gain about 1.
    """

    position_noise: float | None = None
    tension_noise: float | None = None
    winch_speed_noise: float | None = None
    tension_offset_uncertainty: float = 0.0
    position_offset_uncertainty: float = 0.0
    tension_gain_uncertainty: float = 0.0
    orientation_noise: float | None = None


@dataclass(frozen=True)
class Cable:
    """One cable: ``anchor`` in m, ``modulus`` in Pa, ``area`` in m^2, ``damping`` in Pa s; ``law``.

    ``attachment`` is where it holds a rigid platform, in m in the platform's frame; ``swivel_axis`` the unit vector
    along which the rope arrives at its exit pulley and about which that swivels. ``modulus_uncertainty``,
    ``damping_uncertainty`` and, for each coordinate, ``anchor_uncertainty`` and ``attachment_uncertainty``: standard
    deviations of the true values, in the same units.
    """

    anchor: Point
    modulus: float
    area: float
    damping: float
    law: str
    modulus_uncertainty: float = 0.0
    damping_uncertainty: float = 0.0
    anchor_uncertainty: float = 0.0
    attachment: Point = (0.0, 0.0, 0.0)
    attachment_uncertainty: float = 0.0
    swivel_axis: Point = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Winch:
    """Speed-controlled winch: a PI speed loop on the motor's inertia.

    ``drum_radius`` in m; ``gear``, motor turns per drum turn; ``bandwidth``, the loop's natural frequency, in Hz;
    limits of the rope in m/s and m/s^2, None where there is none.
    """

    drum_radius: float
    gear: float = 1.0
    bandwidth: float = 10.0
    damping_ratio: float = 1.0
    speed_limit: float | None = None
    acceleration_limit: float | None = None


@dataclass(frozen=True)
class UserFmu:
    """A user's FMU that replaces one of the project's: ``slot`` is ``platform``, ``cable_2``, ``winch_1`` ..."""

    slot: str
    path: Path


def fmu_slots(cable_count: int) -> tuple[str, ...]:
    """All components that a user's FMU may replace: ``platform``, ``cable_1`` ..., ``winch_1`` ..."""
    numbers = range(1, cable_count + 1)
    return ("platform", *(f"cable_{i}" for i in numbers), *(f"winch_{i}" for i in numbers))


@dataclass(frozen=True)
class EffectSetting:
    """One effect switched on: ``values`` by parameter name, in the parameters' units.

    ``cables`` counts from 1 and is kept ascending; empty where the effect acts on no cable or winch.
    """

    name: str
    values: Mapping[str, float]
    cables: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", Numbers(self.values))
        object.__setattr__(self, "cables", tuple(sorted(set(self.cables))))


@dataclass(frozen=True)
class InitialState:
    """Initial state of a run that is not at rest: ``velocity`` (m/s), ``tensions`` on top of the static ones (N).

    Of a platform that turns also its ``angular_velocity`` (rad/s, in the axes of the world), and its ``orientation``
    where that is none of static equilibrium.
    """

    velocity: Point
    tensions: tuple[float, ...]
    angular_velocity: Point = (0.0, 0.0, 0.0)
    orientation: Quaternion | None = None


@dataclass(frozen=True)
class Formula:
    """A user-defined law as arithmetic: ``text``, in N (kg for ``mass``), adds to the ``target`` of the laws.

    Targets: the keys of :data:`tautwire_fmu.laws.formula.VARIABLES_BY_TARGET`. ``cables`` counts from 1, empty on the
    platform. ``numbers`` are values of names that the text uses beside the variables of its target; a file has none.
    """

    target: str
    text: str
    cables: tuple[int, ...] = ()
    numbers: Mapping[str, float] = Numbers({})

    def __post_init__(self) -> None:
        object.__setattr__(self, "numbers", Numbers(self.numbers))
        object.__setattr__(self, "cables", tuple(sorted(set(self.cables))))


@dataclass(frozen=True)
class RecordedColumn:
    """A column as the laboratory records it: its SI value is ``sign * factor * unit * (recorded - offset)``.

    ``column`` is the standard name and ``name`` the laboratory's, both with ``{}`` for the number of each cable, or
    neither. A blank ``unit`` is the one that the recording states, or SI; ``file`` and ``table`` say where this is
    declared.
    """

    column: str
    name: str
    unit: str = ""
    factor: float = 1.0
    sign: float = 1.0
    offset: float = 0.0
    file: str = field(default="", compare=False)
    table: str = field(default="recording.columns", compare=False)


@dataclass(frozen=True)
class Tracker:
    """A tracker that records positions into a file of its own: its columns, and its clock where that is known.

    At the first sample of the winches' log it shows ``clock_offset``, in s, and from there runs ``clock_rate`` times as
    fast; None where the offset is to be estimated, and then the rate is too.
    """

    columns: tuple[RecordedColumn, ...] = ()
    clock_offset: float | None = None
    clock_rate: float = 1.0


@dataclass(frozen=True)
class Robot:
    """A cable-driven parallel robot as declared; ``gravity`` in m/s^2.

    Without a ``winch`` the rope runs at the commanded speed. Settings of one effect are adjacent in ``effects``, as
    in a file; otherwise their order is kept. ``native_fmus`` asks for our own FMUs as machine code. An
    ``initial_state`` belongs to a run, no file has one; nor a start that ``start_is_measured``, by axis, which is as
    the position sensor shows it.
    """

    name: str
    gravity: float
    platform: Platform
    tension: TensionLimits | None
    sensors: Sensors
    cables: tuple[Cable, ...]
    effects: tuple[EffectSetting, ...] = ()
    winch: Winch | None = None
    fmus: tuple[UserFmu, ...] = ()
    formulas: tuple[Formula, ...] = ()
    recorded_columns: tuple[RecordedColumn, ...] = ()
    tracker: Tracker = Tracker()
    native_fmus: bool = False
    initial_state: InitialState | None = None
    start_is_measured: tuple[bool, bool, bool] = (False, False, False)

    def __post_init__(self) -> None:
        names = list(dict.fromkeys(setting.name for setting in self.effects))
        grouped = tuple(sorted(self.effects, key=lambda setting: names.index(setting.name)))
        object.__setattr__(self, "effects", grouped)

    @property
    def cable_count(self) -> int:
        """Number of cables."""
        return len(self.cables)

    @property
    def cable_numbers(self) -> tuple[int, ...]:
        """All cables, counted from 1."""
        return tuple(range(1, len(self.cables) + 1))

    @property
    def winch_numbers(self) -> tuple[int, ...]:
        """The cables, counted from 1, driven by a winch model: all with a ``winch``, else those with a user's FMU."""
        slots_taken = {fmu.slot for fmu in self.fmus}
        return tuple(cable for cable in self.cable_numbers if self.winch or f"winch_{cable}" in slots_taken)

    @property
    def anchors(self) -> tuple[Point, ...]:
        """Exit points of all cables, in m."""
        return tuple(cable.anchor for cable in self.cables)

    @property
    def attachments(self) -> tuple[Point, ...]:
        """Attachment points of all cables in the platform's frame, in m; its origin for a point mass."""
        return tuple(cable.attachment for cable in self.cables)

    @property
    def axes_in_plane(self) -> tuple[int, ...]:
        """Axes along which not all anchors and the start have one coordinate: two of a point mass in a plane."""
        if self.platform.is_rigid_body:
            return tuple(range(len(AXES)))
        points = [self.platform.start, *self.anchors]
        return tuple(axis for axis in range(len(AXES)) if len({point[axis] for point in points}) > 1)

    def effects_on_cable(self, cable: int) -> tuple[EffectSetting, ...]:
        """The settings that act on one cable, or on its winch; ``cable`` counts from 1."""
        return tuple(setting for setting in self.effects if cable in setting.cables)

    def effects_elsewhere(self) -> tuple[EffectSetting, ...]:
        """The settings that act on no cable or winch, such as those on the platform."""
        return tuple(setting for setting in self.effects if not setting.cables)

    def formulas_on(self, cable: int = 0) -> tuple[Formula, ...]:
        """The formulas that act in one cable, or on the platform; ``cable`` counts from 1."""
        return tuple(f for f in self.formulas if (cable in f.cables if cable else not f.cables))

    def with_effect(self, setting: EffectSetting) -> "Robot":
        """This robot with one more effect; the new setting replaces the same effect on the same cables."""
        settings: list[EffectSetting] = []
        is_placed = False
        for existing in self.effects:
            if existing.name == setting.name and existing.cables == setting.cables:
                settings.append(setting)
                is_placed = True
            elif existing.name == setting.name and set(existing.cables) & set(setting.cables):
                # An effect acts on a cable once: contributions add up, and two moduli would not.
                remaining_cables = tuple(cable for cable in existing.cables if cable not in setting.cables)
                settings.extend([replace(existing, cables=remaining_cables)] if remaining_cables else [])
            else:
                settings.append(existing)
        return replace(self, effects=(*settings, *(() if is_placed else (setting,))))

    def with_fmus(self, fmus: Iterable[UserFmu]) -> "Robot":
        """This robot with more user FMUs; a new one replaces an existing one in its slot."""
        by_slot = {fmu.slot: fmu for fmu in (*self.fmus, *fmus)}
        return replace(self, fmus=tuple(by_slot.values()))

    def as_modelled(self) -> "Robot":
        """This robot as the laws model it: rope at the drum encoder's speed, no user FMU."""
        return replace(self, winch=None, fmus=())

    def without_effects(self) -> "Robot":
        """This robot without any effect or formula."""
        return replace(self, effects=(), formulas=())


def validate_robot(where: str, value: object) -> Robot:
    """Returns the value if it is a Robot; raises ArgumentError otherwise."""
    return validate_instance(where, value, Robot, "give what read_robot returns")
