"""Numbers of a robot file that no robot has, and the unit in which they were probably written."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from ..errors import RobotFileError
from .schema import Cable, Robot

MODULI, PSI = (2e8, 1e12), 6894.757  # Pa, from nylon to the stiffest fibre
STRESSES = (1e6, 2e9)  # Pa
MAX_AREA = 0.05  # m^2, of a rope 25 cm thick
# A rope thicker than 16 mm is there to carry more than this: else its area is a diameter.
MIN_THICK_AREA, MIN_STRESS, MIN_STRAIN = 2e-4, 1e6, 2e-4  # m^2, Pa
MAX_COORDINATE = 2000.0  # m
MAX_DRUM_RADIUS = 5.0  # m
MAX_UNCERTAINTY_RATIO = 0.1  # of a point, by its distance to the farthest exit point
MAX_GRAVITY, STANDARD_GRAVITY = 30.0, 9.80665  # m/s^2
MAX_RETARDATION = 2.0  # s, damping by modulus; polymer ropes have some 1e-2
MAX_SIZE_RATIO = 10.0  # of the platform, by the distance from it to the farthest exit point
MAX_FREQUENCY = 5000.0  # Hz, of a platform on ropes
MAX_DAMPING_RATIO = 500.0  # of the highest mode
DAMPING_HINT = "write it in Pa s, as modulus times the rope's time of retardation; 0.01 s is usual"


def implausible_units(robot: Robot, file: str) -> Iterator[RobotFileError]:
    """Errors for numbers that no cable robot has, each with the unit that was probably meant.

    They are modulus, area, damping and anchors of the cables, points that are uncertain by a tenth of the robot, and
    what makes a rigid platform larger than its frame; where each alone is plausible, an upper bound of the highest
    modal frequency, ``f = sqrt(sum_i E_i A_i / L_i / m) / 2 pi``, and of its damping ratio, ``pi f max_i eta_i / E_i``.
    """
    weight = robot.platform.mass * robot.gravity / robot.cable_count
    load = max(weight, robot.tension.preferred if robot.tension else 0.0)
    errors = []
    for number, cable in enumerate(robot.cables, 1):
        errors += [*_cable_errors(cable, number, weight, file), *_diameter_errors(cable, number, load, file)]
    errors += list(_weight_errors(robot, file)) or _thin_rope_errors(robot, weight, file)
    errors += [*_platform_errors(robot, file), *_uncertainty_errors(robot, file), *_gravity_errors(robot, file)]
    errors += _drum_errors(robot, file)
    yield from errors
    if any(abs(coordinate) > MAX_COORDINATE for coordinate in robot.platform.start):
        problem = f"is {max(map(abs, robot.platform.start)):g} m from the origin, no robot is larger than 2 km"
        yield _error(file, ("platform", "start"), problem, "write it in m, if this is in mm multiply by 0.001")
    elif not errors:
        yield from _stiffness_errors(robot, file)


def _cable_errors(cable: Cable, number: int, weight: float, file: str) -> Iterator[RobotFileError]:
    modulus, area = cable.modulus, cable.area
    area_in_m2 = area if area <= MAX_AREA else 1e-6 * area
    if modulus * area_in_m2 < weight and not _is_a_ropes(cable):
        problem = (
            f"is {modulus:g} Pa, with which its share of the weight, {weight:.3g} N, would stretch it to twice its "
            "length"
        )
        meant = {"in GPa": 1e9 * modulus, "in MPa": 1e6 * modulus, "in psi": PSI * modulus}
        meant |= {"E A in N": modulus / area_in_m2}
        hint = f"write it in Pa, {_alternatives(meant, MODULI)}"
        yield _error(file, ("cable", number - 1, "modulus"), problem, hint)
    elif cable.damping > MAX_RETARDATION * modulus:
        problem = (
            f"is {cable.damping:g} Pa s, {cable.damping / modulus:.3g} s times the modulus, ropes have at most 2 s"
        )
        yield _error(file, ("cable", number - 1, "damping"), problem, DAMPING_HINT)
    if area > MAX_AREA:
        problem = f"is {area:g} m^2, ropes have at most {MAX_AREA:g}"
        meant = {"in mm^2": 1e-6 * area, "in cm^2": 1e-4 * area}
        meant |= {"the diameter in mm": math.pi / 4.0 * (1e-3 * area) ** 2}
        hint = f"write it in m^2, {_alternatives(meant, tuple(max(weight, 1.0) / stress for stress in STRESSES))}"
        yield _error(file, ("cable", number - 1, "area"), problem, hint)
    if any(abs(coordinate) > MAX_COORDINATE for coordinate in cable.anchor):
        problem = f"is {max(map(abs, cable.anchor)):g} m from the origin, no robot is larger than 2 km"
        yield _error(
            file, ("cable", number - 1, "anchor"), problem, "write it in m, if this is in mm multiply by 0.001"
        )


def _alternatives(meant: Mapping[str, float], plausible: Sequence[float]) -> str:
    """What a number may be instead, each with what to write then; those within plausible bounds, if there are any."""
    low, high = sorted(plausible)
    likely = {what: value for what, value in meant.items() if low <= value <= high} or dict(list(meant.items())[:1])
    return ", ".join(f"if this is {what} as {value:.6g}" for what, value in likely.items())


def _diameter_errors(cable: Cable, number: int, load: float, file: str) -> Iterator[RobotFileError]:
    """Error for an area that makes a stiff rope far too thick for its load, in N: it is probably the diameter."""
    area, stress = cable.area, load / cable.area
    if MIN_THICK_AREA < area <= MAX_AREA and 0.0 < stress < min(MIN_STRESS, MIN_STRAIN * cable.modulus):
        thickness = 2e3 * math.sqrt(area / math.pi)
        problem = f"is {area:g} m^2, a rope {thickness:.0f} mm thick, and some {load:.3g} N are all that it carries"
        meant = {"the diameter in m": math.pi / 4.0 * area**2, "in mm^2": 1e-6 * area}
        hint = f"write the area in m^2, {_alternatives(meant, tuple(load / stress for stress in STRESSES))}"
        yield _error(file, ("cable", number - 1, "area"), problem, hint)


def _thin_rope_errors(robot: Robot, weight: float, file: str) -> Iterator[RobotFileError]:
    """Error for each rope that its share of the weight would stretch to twice its length, though its modulus may be."""
    for number, cable in enumerate(robot.cables):
        if cable.modulus * cable.area < weight and _is_a_ropes(cable):
            problem = (
                f"is {cable.area:g} m^2, with which its share of the weight, {weight:.3g} N, would stretch it to twice "
                "its length"
            )
            hint = f"write it in m^2, if it was converted from mm^2 twice as {1e6 * cable.area:g}"
            yield _error(file, ("cable", number, "area"), problem, hint)


def _is_a_ropes(cable: Cable) -> bool:
    """Whether a rope may have the modulus, and the area, whatever it carries."""
    return MODULI[0] <= cable.modulus <= MODULI[1] and cable.area <= MAX_AREA


def _weight_errors(robot: Robot, file: str) -> Iterator[RobotFileError]:
    """Error for a mass that all ropes together cannot hold: they would stretch twofold, or exceed their bound."""
    platform, weight = robot.platform, robot.platform.mass * robot.gravity
    ropes = f"all {robot.cable_count} ropes together"
    stiffness = sum(cable.modulus * cable.area for cable in robot.cables)
    bound = robot.cable_count * robot.tension.maximum if robot.tension else math.inf
    if weight > bound:
        problem = f"weighs {weight:.4g} N, more than the {bound:.4g} N that {ropes} may bear by tension.maximum"
    elif weight > stiffness and all(map(_is_a_ropes, robot.cables)):
        problem = f"weighs {weight:.4g} N, which would stretch {ropes} to twice their length (E A is {stiffness:.3g} N)"
    else:
        return
    stress = 1e-3 * weight / sum(cable.area for cable in robot.cables)
    in_g = f"if this is in g as {1e-3 * platform.mass:.6g}, " if stress < STRESSES[1] else ""
    hint = f"write it in kg, {in_g}or compare modulus, area and tension.maximum"
    yield _error(file, ("platform", "mass"), f"is {platform.mass:g} kg and {problem}", hint)


def _gravity_errors(robot: Robot, file: str) -> Iterator[RobotFileError]:
    """Error for a gravity of no planet, or of 1, which is that of the Earth in g."""
    if robot.gravity > MAX_GRAVITY:
        hint = f"write it in m/s^2, if this is in mm/s^2 as {robot.gravity / 1e3:g}"
        yield _error(file, ("gravity",), f"is {robot.gravity:g} m/s^2, {STANDARD_GRAVITY:.3g} on the Earth", hint)
    elif robot.gravity == 1.0:
        hint = f"write it in m/s^2, if this is in g as {STANDARD_GRAVITY:g}; on the Moon it is 1.62"
        yield _error(file, ("gravity",), "is 1 m/s^2, as of no planet or moon that has robots", hint)


def _drum_errors(robot: Robot, file: str) -> Iterator[RobotFileError]:
    """Error for a drum larger than any winch has."""
    radius = robot.winch.drum_radius if robot.winch else 0.0
    if radius > MAX_DRUM_RADIUS:
        hint = f"write it in m, if this is in mm as {1e-3 * radius:g}"
        problem = f"is {radius:g} m, drums have at most {MAX_DRUM_RADIUS:g}"
        yield _error(file, ("winch", "drum_radius"), problem, hint)


def _platform_errors(robot: Robot, file: str) -> Iterator[RobotFileError]:
    """Errors for attachments, centre of mass and radius of gyration far beyond the exit points."""
    platform, frame = robot.platform, _frame_radius(robot)
    # Points may be far out on a mast; the mass of a platform lies within its frame.
    points = [
        (("cable", index, "attachment"), cable.attachment, MAX_SIZE_RATIO * frame)
        for index, cable in enumerate(robot.cables)
    ]
    for key_path, point, reach in [*points, (("platform", "centre_of_mass"), platform.centre_of_mass, frame)]:
        distance = math.hypot(*point)
        if distance > reach:
            problem = f"is {distance:g} m from the platform's origin, robots of this frame have at most {reach:.3g}"
            yield _error(file, key_path, problem, "write it in m, if this is in mm multiply by 0.001")
    trace = sum(row[axis] for axis, row in enumerate(platform.inertia or ()))
    radius = math.sqrt(0.5 * trace / platform.mass)
    if radius > frame:
        problem = f"puts the mass {radius:.3g} m from its centre, robots of this frame have at most {frame:.3g}"
        units = "if this is in kg cm^2 multiply by 1e-4, in kg mm^2 by 1e-6, in g cm^2 by 1e-7"
        hint = f"write it in kg m^2, {units}; and the mass in kg"
        yield _error(file, ("platform", "inertia"), problem, hint)


def _uncertainty_errors(robot: Robot, file: str) -> Iterator[RobotFileError]:
    """Errors for exit points and attachments that are known to no better than a tenth of the robot."""
    limit = MAX_UNCERTAINTY_RATIO * _frame_radius(robot)
    for index, cable in enumerate(robot.cables):
        deviations = {
            "anchor_uncertainty": cable.anchor_uncertainty,
            "attachment_uncertainty": cable.attachment_uncertainty,
        }
        for key, deviation in deviations.items():
            if deviation > limit:
                problem = f"is {deviation:g} m, more than a tenth of this robot"
                yield _error(file, ("cable", index, key), problem, "write it in m, if this is in mm multiply by 0.001")


def _frame_radius(robot: Robot) -> float:
    """Distance from the start to the farthest exit point, in m."""
    return max(math.dist(cable.anchor, robot.platform.start) for cable in robot.cables)


def _stiffness_errors(robot: Robot, file: str) -> Iterator[RobotFileError]:
    lengths = [math.dist(cable.anchor, robot.platform.start) for cable in robot.cables]
    stiffness = sum(
        c.modulus * c.area / length for c, length in zip(robot.cables, lengths, strict=True) if length > 0.0
    )
    frequency = math.sqrt(stiffness / robot.platform.mass) / (2.0 * math.pi)
    if frequency > MAX_FREQUENCY:
        problem = (
            f"of {robot.platform.mass:g} kg on ropes of {stiffness:.3g} N/m has modes of up to "
            f"{frequency / 1e3:.3g} kHz, robots have at most {MAX_FREQUENCY / 1e3:g} kHz"
        )
        hint = "compare the units of mass (kg), modulus (Pa), area (m^2) and anchors (m)"
        yield _error(file, ("platform", "mass"), problem, hint)
        return
    yield from _rotation_errors(robot, file)
    times = [cable.damping / cable.modulus for cable in robot.cables]
    ratio = math.pi * frequency * max(times)
    if ratio > MAX_DAMPING_RATIO:
        problem = (
            f"is {max(times):.3g} s times the modulus, with which modes of up to {frequency:.3g} Hz have damping "
            f"ratios of up to {ratio:.0f}, robots have at most {MAX_DAMPING_RATIO:.0f}"
        )
        yield _error(file, ("cable", times.index(max(times)), "damping"), problem, DAMPING_HINT)


def _rotation_errors(robot: Robot, file: str) -> Iterator[RobotFileError]:
    """Error for an inertia so small that the platform would turn faster on its ropes than any, by an upper bound."""
    platform = robot.platform
    if platform.inertia is None:
        return
    least = min(row[axis] for axis, row in enumerate(platform.inertia))
    stiffness = sum(
        cable.modulus * cable.area / length * math.dist(cable.attachment, platform.centre_of_mass) ** 2
        for cable in robot.cables
        if (length := math.dist(cable.anchor, platform.start)) > 0.0
    )
    frequency = math.sqrt(stiffness / least) / (2.0 * math.pi)
    if frequency > MAX_FREQUENCY:
        problem = (
            f"of {least:.3g} kg m^2 makes the platform turn on its ropes at up to {frequency / 1e3:.3g} kHz, robots "
            f"have at most {MAX_FREQUENCY / 1e3:g} kHz"
        )
        yield _error(file, ("platform", "inertia"), problem, "write it in kg m^2, about the centre of mass")


def _error(file: str, key_path: tuple[str | int, ...], problem: str, hint: str) -> RobotFileError:
    key = "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in key_path).lstrip(".")
    return RobotFileError(f"{file}: {key}", problem, hint, key_path)
