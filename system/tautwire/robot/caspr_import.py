"""Robots of CASPR as robot files: a rigid platform on cables, from the XML files of its bodies and cables.

CASPR is a MATLAB toolbox for cable robots. A folder of its models has NAME_bodies.xml and NAME_cables.xml; lengths are
in m, the frame of the platform is that of its joint, and cables are ideal, or springs of stiffness K / length. What a
robot file needs beside that are assumptions, and what it cannot have is left out: both are told.

Source: Lau, Eden, Tan and Oetomo (2016), CASPR, IEEE/RSJ International Conference on Intelligent Robots and Systems.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..errors import InputError, RobotFileError, UnreachableError
from .robot_file_reader import robot_from_text
from .robot_file_text import robot_text
from .schema import Cable, EffectSetting, Platform, Point, Quaternion, Robot, Sensors, TensionLimits
from .static_equilibrium import static_tensions

Array = NDArray[np.float64]

MAX_BYTES = 5_000_000
GRAVITY = 9.81  # m/s^2, as in CASPR
# Numbers behind the position in a joint's initial values.
JOINTS = {"SPATIAL_EULER_XYZ": 3, "SPATIAL_QUATERNION": 4}
CABLE_KINDS = ("cable_ideal", "cable_linear_spring")
# Of the range between the limits, above the lower one: where a cable counts as taut, and preferred tensions.
TAUT_SHARE = 0.01
PREFERRED_SHARES = (0.1, 0.2, 0.3, 0.4, 0.5)


class CasprError(InputError):
    """A folder is no model of CASPR that a robot file can have."""


@dataclass(frozen=True)
class Rope:
    """What CASPR does not know of a rope: ``modulus`` in Pa, ``area`` in m^2, ``damping`` in Pa s.

    By default the steel wire rope of 4 mm of Baklouti et al. 2017, section 3, with a guess at light damping.
    """

    modulus: float = 1.022e11
    area: float = 7.1675e-6
    damping: float = 1.0e8


@dataclass(frozen=True)
class ImportedRobot:
    """A robot, and one line for each assumption and for what was left out."""

    robot: Robot
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _CableEnds:
    """Where a cable leaves the frame and holds the platform; a pulley has a radius (m) and an axis of swivel."""

    anchor: Point
    attachment: Point
    radius: float | None = None
    swivel_axis: Point = Cable.swivel_axis


def read_caspr_robot(folder: str | Path, cable_set: str | None = None, rope: Rope | None = None) -> ImportedRobot:
    """Reads a robot of CASPR from its folder; ``cable_set`` by default the one that the file names.

    Raises CasprError where the folder holds no such robot, or one that a robot file cannot have: more than one body,
    another joint than a free one, cables over several bodies.
    """
    rope, source = rope or Rope(), Path(folder)
    bodies, cables = (_parsed(source, kind) for kind in ("bodies", "cables"))
    platform, name, notes = _platform(bodies, source)
    chosen = _cable_set(cables, cable_set, source)
    elements = list(chosen)
    if not elements:
        raise _error(source, "its cable set is empty", "choose another one with --cables")
    for element in elements:
        if element.tag not in CABLE_KINDS:
            raise _error(source, f"{_named(element)} is a {element.tag}", f"only {' and '.join(CABLE_KINDS)} are read")
    ends = [_cable_ends(element, platform.centre_of_mass, source) for element in elements]
    declared = Robot(
        name=name,
        gravity=GRAVITY,
        platform=platform,
        tension=_tension_limits(elements, source),
        sensors=Sensors(),
        cables=tuple(_cable(each, element, rope, source) for each, element in zip(ends, elements, strict=True)),
        effects=_pulleys(ends),
    )
    robot = _with_taut_cables(_validated(declared, source))
    return ImportedRobot(robot, (*notes, *_assumptions(elements, rope, robot), *_left_out(source, cables, chosen)))


def _parsed(folder: Path, kind: str) -> Element:
    """The root of a folder's only XML file of a kind."""
    if not folder.is_dir():
        raise CasprError(str(folder), "is no folder", "give that of a CASPR model, with NAME_bodies.xml")
    files = sorted(folder.glob(f"*_{kind}.xml"))
    if len(files) != 1:
        problem = f"has {len(files)} files *_{kind}.xml, one is expected"
        raise CasprError(str(folder), problem, "give the folder of one CASPR model")
    if files[0].stat().st_size > MAX_BYTES:
        raise CasprError(str(files[0]), f"is larger than {MAX_BYTES} bytes", "give the file of one robot")
    try:
        return ElementTree.parse(files[0]).getroot()
    except (ElementTree.ParseError, UnicodeError) as problem:
        raise CasprError(str(files[0]), f"is no valid XML: {problem}", "export the model again") from problem


def _platform(root: Element, folder: Path) -> tuple[Platform, str, list[str]]:
    """The platform, the robot's name, and what was assumed."""
    links = list(root.iter("link_rigid"))
    if len(links) != 1:
        raise _error(folder, f"it has {len(links)} rigid links", "only robots of one body, the platform, are read")
    (link,) = links
    joint, physical, inertia = (_child(link, path, folder) for path in ("joint", "physical", "physical/inertia"))
    kind = joint.get("type", "")
    if kind not in JOINTS:
        raise _error(folder, f"its joint is {kind or 'not named'}", f"only {' and '.join(JOINTS)} are read")
    mass = _numbers(physical, "mass", 1, folder)[0]
    centre = _numbers(physical, "com_location", 3, folder)
    tensor = _inertia(inertia, mass, centre, folder)
    start, orientation, notes = _start(joint, kind, folder)
    start = start + _numbers(link, "parent/location", 3, folder)
    rows = tuple(_point(row) for row in tensor)
    platform = Platform(
        mass=mass,
        start=_point(start),
        inertia=(rows[0], rows[1], rows[2]),
        centre_of_mass=_point(centre),
        start_orientation=orientation,
    )
    return platform, link.get("name") or folder.resolve().name, notes


def _inertia(element: Element, mass: float, centre: Array, folder: Path) -> Array:
    """Inertia (3, 3) about the centre of mass; CASPR states its entries about that or about the joint."""
    entries = {name: _numbers(element, name, 1, folder)[0] for name in ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")}
    rows = [[entries["I" + "".join(sorted(row + column))] for column in "xyz"] for row in "xyz"]
    tensor = np.array(rows)
    reference = element.get("ref")
    if reference == "joint":
        return np.asarray(tensor - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre)))
    if reference != "com":
        raise _error(folder, f"the inertia's ref is {reference!r}", "it has to be com or joint")
    return tensor


def _start(joint: Element, kind: str, folder: Path) -> tuple[Array, Quaternion, list[str]]:
    """Position (m) and orientation at the start, with a note where the model states none."""
    text = joint.get("q_initial")
    if text is None:
        return np.zeros(3), Platform.start_orientation, ["the model states no pose: the start is at its origin"]
    values = _parsed_numbers(text, 3 + JOINTS[kind], "q_initial", folder)
    if kind == "SPATIAL_EULER_XYZ":
        x, y, z, w = Rotation.from_euler("XYZ", values[3:]).as_quat()
    else:
        w, x, y, z = _unit_vector(values[3:], "q_initial", folder)
    return values[:3], (float(w), float(x), float(y), float(z)), []


def _cable_set(root: Element, name: str | None, folder: Path) -> Element:
    sets = {each.get("id", ""): each for each in root.iter("cable_set")}
    wanted = root.get("default_cable_set", "") if name is None else name
    if wanted not in sets:
        hint = f"choose among {', '.join(sets) or 'none'} with --cables"
        raise _error(folder, f"it has no cable set {wanted!r}", hint)
    return sets[wanted]


def _cable_ends(element: Element, centre: Point, folder: Path) -> _CableEnds:
    """The two ends of a cable; attachments count from the joint, or from the centre of mass."""
    ends = list(_child(element, "attachments", folder))
    on_frame = [end for end in ends if end.tag == "base_rotating_pulley" or end.findtext("link", "").strip() == "0"]
    on_platform = [end for end in ends if end.tag == "attachment" and end.findtext("link", "").strip() == "1"]
    if len(ends) != 2 or len(on_frame) != 1 or len(on_platform) != 1:
        hint = "a cable has to run from the frame (link 0) straight to the platform (link 1)"
        raise _error(folder, f"{_named(element)} has {len(ends)} attachments", hint)
    attachment = _numbers(on_platform[0], "location", 3, folder)
    if element.get("attachment_reference") == "com":
        attachment = attachment + np.array(centre)
    (outlet,) = on_frame
    if outlet.tag == "attachment":
        return _CableEnds(_point(_numbers(outlet, "location", 3, folder)), _point(attachment))
    axis = _numbers(outlet, "cable_entry_vector", 3, folder)
    return _CableEnds(
        _point(_numbers(outlet, "fixed_location", 3, folder)),
        _point(attachment),
        _numbers(outlet, "pulley_radius", 1, folder)[0],
        _point(_unit_vector(axis, "cable_entry_vector", folder)),
    )


def _cable(ends: _CableEnds, element: Element, rope: Rope, folder: Path) -> Cable:
    """A cable; of a spring the axial stiffness is its K."""
    modulus = rope.modulus
    if element.tag == "cable_linear_spring":
        modulus = _numbers(element, "properties/K", 1, folder)[0] / rope.area
    return Cable(
        anchor=ends.anchor,
        modulus=modulus,
        area=rope.area,
        damping=rope.damping,
        law="logarithmic",
        attachment=ends.attachment,
        swivel_axis=ends.swivel_axis,
    )


def _pulleys(ends: Sequence[_CableEnds]) -> tuple[EffectSetting, ...]:
    """The effect ``pulley``, once for each radius."""
    radii = sorted({end.radius for end in ends if end.radius is not None})
    by_radius = {radius: tuple(i for i, end in enumerate(ends, 1) if end.radius == radius) for radius in radii}
    return tuple(EffectSetting("pulley", {"radius": radius}, cables) for radius, cables in by_radius.items())


def _tension_limits(elements: Sequence[Element], folder: Path) -> TensionLimits:
    """The limits within which all cables may be."""
    low = max(_numbers(each, "properties/force_min", 1, folder)[0] for each in elements)
    high = min(_numbers(each, "properties/force_max", 1, folder)[0] for each in elements)
    return TensionLimits(float(low), float(high), float(low + PREFERRED_SHARES[0] * (high - low)))


def _validated(robot: Robot, folder: Path) -> Robot:
    """The robot as a robot file has it; CasprError where none can."""
    try:
        return robot_from_text(robot_text(robot), folder, robot.name)
    except RobotFileError as error:
        raise CasprError(error.where, error.problem, "correct the model, or export it again") from error


def _with_taut_cables(robot: Robot) -> Robot:
    """The robot with the least preferred tension that leaves no cable at its lower limit; as it is if there is none."""
    limits = robot.tension
    assert limits is not None
    span = limits.maximum - limits.minimum
    for share in PREFERRED_SHARES:
        tried = replace(robot, tension=replace(limits, preferred=limits.minimum + share * span))
        try:
            lowest = float(np.min(static_tensions(tried)))
        except UnreachableError:
            return robot
        if lowest > limits.minimum + TAUT_SHARE * span:
            return tried
    return robot


def _assumptions(elements: Sequence[Element], rope: Rope, robot: Robot) -> list[str]:
    limits = robot.tension
    assert limits is not None
    elasticity = f"area {rope.area:g} m^2 and damping {rope.damping:g} Pa s of the ropes"
    if any(element.tag == "cable_ideal" for element in elements):
        elasticity = f"modulus {rope.modulus:g} Pa, {elasticity}"
    notes = [f"assumed, as CASPR has none: {elasticity}; gravity {GRAVITY:g} m/s^2, along -z"]
    share = (limits.preferred - limits.minimum) / max(limits.maximum - limits.minimum, 1e-300)
    notes.append(f"assumed: a preferred tension of {limits.preferred:g} N, {100.0 * share:.0f} % up between the limits")
    forces = {(e.findtext("properties/force_min"), e.findtext("properties/force_max")) for e in elements}
    if len(forces) > 1:
        notes.append(f"limits differ by cable: {limits.minimum:g} to {limits.maximum:g} N are those that all allow")
    return notes


def _left_out(folder: Path, cables: Element, chosen: Element) -> list[str]:
    """What of the folder a robot file cannot have."""
    others = [each.get("id", "") for each in cables.iter("cable_set") if each is not chosen]
    files = sorted(path.name for path in folder.glob("*.xml") if not re.search(r"_(bodies|cables)\.xml$", path.name))
    return [
        *([f"left out: the other cable sets {', '.join(others)} (choose with --cables)"] if others else []),
        *([f"left out: {', '.join(files)}"] if files else []),
    ]


def _child(element: Element, path: str, folder: Path) -> Element:
    child = element.find(path)
    if child is None:
        raise _error(folder, f"<{path}> is missing in <{element.tag}>", "export the model again")
    return child


def _numbers(element: Element, path: str, count: int, folder: Path) -> Array:
    """Numbers (count,) of a child's text."""
    return _parsed_numbers(_child(element, path, folder).text or "", count, path, folder)


def _parsed_numbers(text: str, count: int, where: str, folder: Path) -> Array:
    try:
        values = np.array([float(each) for each in text.split()])
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.all(np.isfinite(values)):
        raise _error(folder, f"<{where}> is {text.strip()[:60]!r}", f"give {count} finite numbers")
    return values


def _unit_vector(values: Array, where: str, folder: Path) -> Array:
    length = float(np.linalg.norm(values))
    if not length:
        raise _error(folder, f"<{where}> has only zeros", "give a direction or a rotation")
    return values / length


def _point(values: Array) -> Point:
    x, y, z = values.tolist()
    return (x, y, z)


def _named(element: Element) -> str:
    return f"cable {element.get('name', '')!r}"


def _error(folder: Path, problem: str, hint: str) -> CasprError:
    return CasprError(str(folder), problem, hint)
