"""H-infinity loop shaping that keeps disk margins over a range of moduli and payloads.

Four-block mixed sensitivity, ``min || [S_o, S_o G; K S_o, K S_o G] ||``, G the plant with its weights: disturbances
also enter where the winches act, so lightly damped modes are damped, not cancelled. A bilinear map (Tustin)
transforms the sampled plant to a continuous one and the controller back; it preserves the norm.

Sources: McFarlane and Glover (1992), IEEE Transactions on Automatic Control 37(6), 759-769; Glover and Doyle (1988),
Systems and Control Letters 11, 167-172, for the controller, by SLICOT's SB10AD.

The loop is as fast as the margins allow: of several bandwidths the largest is taken at which the worst disk margin
over the whole range, of all winches at once and of each sensor alone, is the required one. The designs at points of a
path have states that estimate the same quantities, so gains can be interpolated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray
from slycot import sb10ad
from slycot.exceptions import SlycotArithmeticError
from threadpoolctl import threadpool_limits

from ..linear import LinearPlant, linearise
from ..linear.nonsmooth import DEFAULT_SWING
from ..robot.active_effects import cable_moduli
from ..robot.rigid_equilibrium import platform_size
from ..robot.schema import Robot
from ..robot.trajectory import Trajectory
from .design import ControlAim, Knot, MarginError, RegulatorDesign, regulator_signals, require_taut
from .gain_scheduling import DESIGN_POINTS, DesignPose, ScheduledController, design_poses
from .reachable_plant import integrated_coordinates, lowest_frequency, reach_notes, reachable_plant, require_reachable
from .sampled_plant import ramp_plant
from .stability_margins import Margins, Range, margins_of

Array = NDArray[np.float64]

# The optimal controller has poles at infinity; a slightly suboptimal one has not.
NORM_FACTOR = 1.1
SB10AD_BISECTION_JOB, SB10AD_GIVEN_NORM_JOB = 1, 4
# Bisection takes as many steps as its first bound has digits; most loops have a norm below ten.
FIRST_NORM_BOUND, LAST_NORM_BOUND = 10.0, 1e100
# Shift of the plant's integrators off the imaginary axis, in 1/s.
INTEGRATOR_LEAK = 1e-5

# Multiples of the lowest mode, from fast to slow.
RELATIVE_BANDWIDTHS = (1.6, 1.2, 0.9, 0.65, 0.48, 0.35, 0.26, 0.19, 0.14, 0.1)
# From measurement to the end of the resulting ramp: one sample for computing, one for the ramp.
LOOP_DELAY_SAMPLES = 2
# Rate of back-calculation relative to the integral action.
BACK_CALCULATION_FACTOR = 3.0


def synthesise_controller(plant: Any, weights: Any) -> Any:
    """Synthesises the H-infinity controller of a sampled ``plant``, to be closed with positive feedback.

    ``weights`` is a continuous ``control.StateSpace`` in the w-plane on the plant's outputs. The
    controller has the states of both.
    """
    period = plant.dt
    shaped = weights * to_continuous(plant)
    state_count, output_count, input_count = shaped.nstates, shaped.noutputs, shaped.ninputs
    A = shaped.A - INTEGRATOR_LEAK * np.eye(state_count)
    B = np.hstack([shaped.B, np.zeros((state_count, output_count)), shaped.B])
    C = np.vstack([shaped.C, np.zeros((input_count, state_count)), shaped.C])
    identity = np.eye(output_count)
    D = np.block(
        [
            [shaped.D, identity, shaped.D],
            [np.zeros((input_count, input_count + output_count)), np.eye(input_count)],
            [shaped.D, identity, shaped.D],
        ]
    )
    sizes = (state_count, B.shape[1], C.shape[0], input_count, output_count)
    # Small matrices: thread synchronisation would dominate the time.
    with threadpool_limits(limits=1, user_api="blas"):
        norm = _smallest_norm(sizes, (A, B, C, D))
        synthesis = sb10ad(*sizes, NORM_FACTOR * norm, A, B, C, D, job=SB10AD_GIVEN_NORM_JOB)
    return to_sampled(control.ss(*synthesis[1:5]) * weights, period)


def _smallest_norm(sizes: tuple[int, ...], matrices: tuple[Array, ...], bound: float = FIRST_NORM_BOUND) -> float:
    """The norm of the optimal controller, by bisection below a bound that some controller keeps."""
    try:
        return float(sb10ad(*sizes, bound, *matrices, job=SB10AD_BISECTION_JOB)[0])
    except SlycotArithmeticError:
        # No controller keeps so low a bound, or none at all.
        if bound >= LAST_NORM_BOUND:
            raise
    return _smallest_norm(sizes, matrices, min(bound**4, LAST_NORM_BOUND))


def to_continuous(system: Any) -> Any:
    """Bilinear transform to the w-plane, ``z = (1 + s h / 2) / (1 - s h / 2)``; no pole may be at -1."""
    h = system.dt
    identity = np.eye(system.nstates)
    inverse = np.linalg.inv(system.A + identity)
    return control.ss(
        2.0 / h * (system.A - identity) @ inverse,
        2.0 / np.sqrt(h) * inverse @ system.B,
        2.0 / np.sqrt(h) * system.C @ inverse,
        system.D - system.C @ inverse @ system.B,
    )


def to_sampled(system: Any, period: float) -> Any:
    """The inverse of :func:`to_continuous`."""
    identity = np.eye(system.nstates)
    inverse = np.linalg.inv(identity - 0.5 * period * system.A)
    return control.ss(
        inverse @ (identity + 0.5 * period * system.A),
        np.sqrt(period) * inverse @ system.B,
        np.sqrt(period) * system.C @ inverse,
        system.D + 0.5 * period * system.C @ inverse @ system.B,
        period,
    )


@dataclass(frozen=True)
class RobustAim:
    """Design aims of a robust controller: ``margin`` is the disk margin; 2/3 allows gain by 2 and 37 degrees of phase.

    As multiples of the lowest mode's angular frequency: ``damping``, the rate at which a cable yields to its own
    tension, and ``integral``, the corner frequency of the integral action of position.
    """

    margin: float = 2.0 / 3.0
    damping: float = 1.0
    integral: float = 0.2


@dataclass(frozen=True)
class RobustController(RegulatorDesign):
    """A robust controller with q states, the first of which are integrals of the pose, or of the position alone.

    ``linear`` is what winches reach of the plant in the middle of the range; ``bandwidth``, that of the pose, is a
    multiple of the lowest mode that stretches a cable; ``margins`` are the worst over the range.
    """

    linear: LinearPlant
    bandwidth: float
    margins: Margins

    @property
    def notes(self) -> tuple[str, ...]:
        """Modes that the winches hardly reach; see :func:`tautwire.control.reachable_plant.reach_notes`."""
        return reach_notes(self.linear)


def design_robust(
    robot: Robot,
    aim: ControlAim | None = None,
    parameter_range: Range | None = None,
    robust: RobustAim | None = None,
    at: Sequence[float] | None = None,
    orientation: Sequence[float] | None = None,
) -> RobustController:
    """Designs the fastest loop whose disk margins hold over a range, at a position (m), by default the start.

    The default range is :meth:`Range.of` the robot. The ``orientation`` of a rigid platform is a unit quaternion, by
    default that of the robot file.

    Raises MarginError where no design does, InputError where a mode that does not decay is out of reach, and what
    :func:`tautwire.linear.linearise` raises.
    """
    start = robot.platform.start if at is None else at
    (design,) = _fastest_designs(
        robot, [(start, orientation)], aim or ControlAim(), parameter_range or Range.of(robot), robust or RobustAim()
    )
    return design


def schedule_robust(
    robot: Robot,
    trajectory: Trajectory,
    aim: ControlAim | None = None,
    parameter_range: Range | None = None,
    robust: RobustAim | None = None,
    points: int = DESIGN_POINTS,
) -> ScheduledController:
    """Gain-scheduled :func:`design_robust` at equidistant times of a path, from its start to its end.

    Raises MarginError where no design does, and what :func:`tautwire.linear.linearise` raises.
    """
    times = np.linspace(0.0, trajectory.duration, points)
    designs = _fastest_designs(
        robot,
        design_poses(trajectory, times),
        aim or ControlAim(),
        parameter_range or Range.of(robot),
        robust or RobustAim(),
    )
    return ScheduledController(tuple(times.tolist()), tuple(designs))


def _fastest_designs(
    robot: Robot, poses: Sequence[DesignPose], aim: ControlAim, parameter_range: Range, robust: RobustAim
) -> list[RobustController]:
    """Designs of one bandwidth at all poses, the largest at which all have the required margin."""
    # Notes on swings take most of the time of a linearisation; those of the nominal plant alone can be read.
    robots = [(parameter_range.middle(robot), DEFAULT_SWING)]
    robots += [(each, 0.0) for _, _, each in parameter_range.robots(robot)]
    plants = [
        [reachable_plant(linearise(each, position, swing, orientation)) for each, swing in robots]
        for position, orientation in poses
    ]
    for nominal_plant, *_ in plants:
        require_taut(robot, nominal_plant)
        require_reachable(robot.name, nominal_plant)
    best_margin = 0.0
    for bandwidth in RELATIVE_BANDWIDTHS:
        designs: list[RobustController] = []
        for nominal_plant, *varied_plants in plants:
            design = _design_at(robot, nominal_plant, varied_plants, aim, robust, bandwidth)
            if design.margins.min_disk < robust.margin:
                best_margin = max(best_margin, design.margins.min_disk)
                break
            designs.append(design)
        else:
            return designs
    raise MarginError(robot.name, robust.margin, best_margin, "ask for less, narrow the range, or sample faster")


def _design_at(
    robot: Robot,
    linear: LinearPlant,
    plants: Sequence[LinearPlant],
    aim: ControlAim,
    robust: RobustAim,
    bandwidth: float,
) -> RobustController:
    """A design with its worst margins over some plants, up to the first that falls short."""
    regulator = _shape_regulator(robot, linear, aim.period, bandwidth, robust)
    share = BACK_CALCULATION_FACTOR * robust.integral * lowest_frequency(linear) * aim.period
    tracking = back_calculation(regulator, share, len(integrated_coordinates(linear)))
    knot = Knot(0.0, regulator, tracking)
    worst = margins_of(plants[0], knot)
    for plant in plants[1:]:
        if worst.min_disk < robust.margin:
            break
        worst = worst.worst_of(margins_of(plant, knot))
    return RobustController(aim, regulator, tracking, linear, bandwidth, worst)


def back_calculation(regulator: Any, share: float, integrated: int) -> Array:
    """Anti-windup gain of the integrals, (q, n): a ``share`` of what makes the commanded speed the limited one.

    The first ``integrated`` states are the integrals. The other states of the regulator are stable by themselves.
    """
    count = regulator.noutputs
    sums, others = slice(0, integrated), slice(integrated, regulator.nstates - count)
    speed_rows = regulator.A[-count:]
    identity = np.eye(others.stop - integrated)
    steady_state = np.linalg.solve(identity - regulator.A[others, others], regulator.A[others, sums])
    steady_gain = speed_rows[:, sums] + speed_rows[:, others] @ steady_state
    gain = np.zeros((regulator.nstates, count))
    gain[sums] = share * regulator.dt * np.linalg.pinv(steady_gain)
    return gain


def _shape_regulator(robot: Robot, linear: LinearPlant, period: float, bandwidth: float, robust: RobustAim) -> Any:
    """Regulator of one loop shape: scaled pose and tensions, and winches that respond two samples later."""
    count, freedoms = len(linear.tensions), linear.degrees_of_freedom
    frequency = lowest_frequency(linear)
    lengths = np.linalg.norm(np.array(robot.anchors) - linear.position, axis=1)
    stiffness = float(np.mean(np.array(cable_moduli(robot)) * [cable.area for cable in robot.cables] / lengths))
    # A rotation weighs as much as the attachments' displacement by it.
    speed = bandwidth * frequency
    pose_weights = np.repeat([speed, speed * platform_size(robot)], [3, freedoms - 3])
    signal_weights = np.append(pose_weights, np.full(count, robust.damping * frequency / stiffness))
    plant = ramp_plant(linear, period)
    scaled = control.ss(plant.A, plant.B, signal_weights[:, None] * plant.C, signal_weights[:, None] * plant.D, period)
    # The pose also by its integral: (s + w) / s.
    corner, sensors = robust.integral * frequency, freedoms + count
    selector = np.eye(sensors)[:, integrated_coordinates(linear)]
    integrated = selector.shape[1]
    weights = control.ss(np.zeros((integrated, integrated)), corner * selector.T, selector, np.eye(sensors))
    synthesised = synthesise_controller(scaled * _delay_system(count, period), weights)
    return _as_regulator(
        control.ss(
            synthesised.A, synthesised.B * signal_weights, synthesised.C, synthesised.D * signal_weights, period
        ),
        count,
    )


def _delay_system(count: int, period: float) -> Any:
    """Delay of LOOP_DELAY_SAMPLES samples for each of ``count`` signals."""
    zeros = np.zeros((count, count))
    unit_delay = control.ss(zeros, np.eye(count), np.eye(count), zeros, period)
    delayed = unit_delay
    for _ in range(LOOP_DELAY_SAMPLES - 1):
        delayed = delayed * unit_delay
    return delayed


def _as_regulator(speed_controller: Any, count: int) -> Any:
    """Converts a controller of the speed two samples later to accelerations of the next sample.

    The speed at the sample's end was computed one sample ago and is part of the state.
    """
    size, sensors, period = speed_controller.nstates, speed_controller.ninputs, speed_controller.dt
    identity_rate, none = np.eye(count) / period, np.zeros
    return control.ss(
        np.block([[speed_controller.A, none((size, count))], [speed_controller.C, none((count, count))]]),
        np.block([[speed_controller.B, none((size, count))], [speed_controller.D, none((count, count))]]),
        np.hstack([none((count, size)), identity_rate]),
        np.hstack([none((count, sensors)), -identity_rate]),
        period,
        **regulator_signals(count, sensors - count),
    )
