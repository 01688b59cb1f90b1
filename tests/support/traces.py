"""A made-up trace with plausible numbers, for the tests of the report; nothing is simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tautwire.cosimulation import RunStatistics
from tautwire.cosimulation.robot_cosimulation import CosimulationResult
from tautwire.estimation.localisation.component_residuals import ComponentResidual, FaultLocalisation, SignalCorrelation
from tautwire.estimation.trace_result import (
    Candidate,
    Comparison,
    ConfusableEffect,
    Detectable,
    Errors,
    Estimate,
    FoundEffect,
    Identifiability,
    Trace,
)
from tautwire.recordings.recording import Recording
from tautwire.reports.run_overview import ReportedRun, RunOverview
from tautwire.robot.schema import Cable, EffectSetting, Platform, Robot, Sensors

Array = NDArray[np.float64]

POSITION_NOISE, TENSION_NOISE = 3e-4, 2.0  # m, N
HALL = ((0.0, 50.0, 50.0), (0.0, -50.0, 50.0), (86.6, 0.0, 50.0))  # m
ROOM = tuple((x, y, z) for z in (6.0, 0.0) for x, y in ((0.0, 0.0), (10.0, 0.0), (10.0, 8.0), (0.0, 8.0)))
HOSTILE = '<img src=x onerror="alert(1)"></script><script>alert(2)</script> & $name'


def made_robot(eight: bool = False, name: str = "three") -> Robot:
    """A robot of three cables in a hall, or of eight in a room."""
    anchors, start = (ROOM, (5.0, 4.0, 2.5)) if eight else (HALL, (28.86, 0.0, 5.0))
    cables = tuple(Cable(anchor, 1.022e11, 1.25664e-5, 4.0e8, "logarithmic") for anchor in anchors)
    sensors = Sensors(POSITION_NOISE, TENSION_NOISE, 2e-4)
    return Robot(name, 9.81, Platform(300.0, start), None, sensors, cables)


def made_motion(robot: Robot, time: Array, damping: float, seed: int) -> CosimulationResult:
    """A slow turn with a vibration that dies out at ``damping`` (1/s) each time that the winches stop."""
    anchors, start = np.array(robot.anchors), np.array(robot.platform.start)
    size = 0.12 * np.ptp(anchors, axis=0).max()
    turn = 2.0 * np.pi * time / time[-1]
    slow = size * np.column_stack((1.0 - np.cos(turn), np.sin(turn), 0.4 * (1.0 - np.cos(2.0 * turn))))
    since = np.mod(time, 10.0)
    frequency = 0.9 + 0.2 * seed
    ring = np.exp(-damping * since) * np.sin(2.0 * np.pi * frequency * since)
    position = start + slow + 4e-3 * ring[:, None] * np.array((0.5, 0.3, 1.0))
    away = anchors - position[:, None, :]
    length = np.linalg.norm(away, axis=2)
    tension = 1500.0 * length / length[0] + 150.0 * ring[:, None] * np.linspace(1.0, 0.4, len(anchors))
    strain = tension / (robot.cables[0].modulus * robot.cables[0].area)
    return CosimulationResult(
        time, position, np.gradient(position, time, axis=0), tension, length, strain * length, strain
    )


def made_recording(path: str, truth: CosimulationResult, random: np.random.Generator) -> Recording:
    """What sensors with noise would have written, with a gap of a second in the last tension."""
    position = truth.position + random.normal(0.0, POSITION_NOISE, truth.position.shape)
    tension = truth.tension + random.normal(0.0, TENSION_NOISE, truth.tension.shape)
    tension[(truth.time > 12.0) & (truth.time < 13.0), -1] = np.nan
    return Recording(path, truth.time, np.zeros_like(tension), tension, position, ("temperature",))


def made_errors(recording: Recording, motion: CosimulationResult) -> Errors:
    """Root mean squares of what a motion leaves of a recording."""
    square = (recording.measured() - motion.measured()) ** 2
    with np.errstate(invalid="ignore"):
        each = np.sqrt(np.array([np.nan if np.isnan(s).all() else np.nanmean(s) for s in square.T]))
    axes, cables = each[:3], each[3:]
    return Errors(float(np.sqrt(np.mean(axes**2))), float(np.sqrt(np.mean(cables**2))), axes, cables)


def made_comparison(role: str, robot: Robot, path: str, samples: int, seed: int) -> Comparison:
    """A recording, and a robot that rings too long before and rightly after."""
    random = np.random.default_rng(seed)
    time = np.linspace(0.0, 40.0, samples)
    truth = made_motion(robot, time, 0.8, seed)
    before, after = made_motion(robot, time, 0.25, seed), made_motion(robot, time, 0.79, seed)
    recording = made_recording(path, truth, random)
    errors = made_errors(recording, before), made_errors(recording, after)
    return Comparison(role, recording, before, after, *errors)


def made_candidates(cables: tuple[int, ...]) -> tuple[Candidate, ...]:
    """Two rounds of hypotheses."""
    tried = (
        (1, "damping", cables, {"damping": 2.1034e9}, 812.4, 1.02, True),
        (1, "modulus", cables, {"modulus": 9.81e10}, 64.2, 2.41, False),
        (1, "modulus", (2,), {"modulus": 9.3e10}, 21.7, 2.62, False),
        (1, "payload", (), {"mass": 0.31}, -1.3, 2.77, False),
        (1, "drag", (), {"area": 1.2}, float("nan"), float("nan"), False),
        *((1, "relaxation", (cable,), {"time": 0.4}, -2.0 - cable, 2.8, False) for cable in cables),
        (2, "modulus", cables, {"modulus": 1.0219e11}, 0.4, 1.02, False),
        (2, "payload", (), {"mass": -0.02}, -0.8, 1.02, False),
    )
    return tuple(Candidate(*each, tuple(each[3])) for each in tried)


def made_separation(cables: tuple[int, ...]) -> Identifiability:
    """Sizes that would have shown, one of them never, and what looks like damping."""
    sizes = (
        Detectable("payload", (), "mass", 0.0195, "kg", {}),
        Detectable("relaxation", cables, "modulus", 3.9e7, "Pa", {"time": 30.0}),
        Detectable("slack", cables, "softness", float("inf"), "N", {}),
    )
    alike = (ConfusableEffect("damping", cables, "relaxation", cables, 0.973, 9142.7),)
    return Identifiability(sizes, alike)


def made_components(cables: tuple[int, ...]) -> FaultLocalisation:
    """Cables whose tensions move with the strain rate, over a platform in balance."""
    noise = np.random.default_rng(5).normal(0.0, 1.0, 400)
    moved = SignalCorrelation("strain rate", 0.98)
    tensions = [
        ComponentResidual(f"cable {i}", "tension", "N", 14.0 * noise, 0.3, 14.0, 2.8, 1.3, moved) for i in cables
    ]
    balance = [
        ComponentResidual("platform", f"force {a}", "N", 0.25 * noise, 0.0, 0.25, 0.25, 1.4, None) for a in "xyz"
    ]
    sentence = "The tensions of all cables deviate; the platform's force balance closes as expected."
    return FaultLocalisation(np.linspace(0.0, 40.0, 400), (*tensions, *balance), "cables (rope or winch)", sentence, ())


def made_trace(
    eight: bool = False,
    check: bool = True,
    name: str = "three",
    path: str = "data/fit.csv",
    samples: int = 4001,
) -> Trace:
    """A trace that found too little damping declared."""
    robot = made_robot(eight, name)
    cables = robot.cable_numbers
    result = FoundEffect(
        "damping", "cable", cables, {"damping": Estimate(2.1034e9, "Pa s", 2.05e9, 2.16e9, 4e8)}, 812.4
    )
    comparisons = [made_comparison("fit", robot, path, samples, 1)]
    if check:
        comparisons.append(made_comparison("check", robot, "data/check.csv", samples, 2))
    floor = Errors(POSITION_NOISE, TENSION_NOISE, np.full(3, POSITION_NOISE), np.full(len(cables), TENSION_NOISE))
    return Trace(
        verdict="effects",
        sentence="The cables damp 5.3 times as strongly as declared: 2.10 GPa s instead of 0.400 GPa s.",
        robot_before=robot,
        robot_after=robot.with_effect(EffectSetting("damping", {"damping": 2.1034e9}, cables)),
        effects=(result,),
        correlations=(),
        also_possible=(("relaxation",), ("creep", "thermal")),
        candidates=made_candidates(cables),
        formula=None,
        comparisons=tuple(comparisons),
        noise_floor=floor,
        noise_before=False,
        noise_after=True,
        normalised_innovation_variance=np.concatenate(([1.01, 0.98, 1.03], np.linspace(0.97, 1.06, len(cables)))),
        autocorrelations=(np.linspace(0.01, 0.05, 3 + len(cables)), np.full(3 + len(cables), 0.047)),
        identifiability=made_separation(cables),
        components=made_components(cables),
        resonances=(),
        alpha=0.01,
        notes=(
            "The winches stood still for 62 % of the fit recording: drum effects would hardly show.",
            *(note for each in comparisons for note in each.recording.notes),
        ),
        seconds=12.34,
    )


def made_run(name: str = "three", samples: int = 801, eight: bool = False) -> ReportedRun:
    """A run of a robot that swings, beside a recording of it; nothing is simulated."""
    robot = made_robot(eight, name)
    motion = made_motion(robot, np.linspace(0.0, 20.0, samples), 0.4, 1)
    overview = RunOverview(1500)
    frame = motion.frame()
    for row in frame.to_numpy():
        overview.add(float(row[0]), row[1:])
    recording = made_recording("run.csv", motion, np.random.default_rng(4))
    statistics = RunStatistics(steps=2000, iterations=17, energy_residual=1e-7, energy_exchanged=250.0)
    return ReportedRun(robot, tuple(frame.columns[1:]), overview, recording, statistics, ("The winches were slow.",))


def nothing_found(trace: Trace) -> Trace:
    """The same recordings with the verdict that nothing is missing."""
    same = tuple(replace(each, before=each.after, errors_before=each.errors_after) for each in trace.comparisons)
    return replace(
        trace,
        verdict="none",
        sentence="The declared model explains both recordings down to the noise.",
        robot_after=trace.robot_before,
        effects=(),
        also_possible=(),
        comparisons=same,
        noise_before=True,
    )


def without_positions(trace: Trace) -> Trace:
    """The same trace where no position was measured and no sensor noise declared."""
    comparisons = []
    for each in trace.comparisons:
        recording = replace(each.recording, position=np.full_like(each.recording.position, np.nan))
        errors = made_errors(recording, each.before), made_errors(recording, each.after)
        comparisons.append(Comparison(each.role, recording, each.before, each.after, *errors))
    robot = replace(trace.robot_before, sensors=Sensors())
    floor = replace(trace.noise_floor, position_rms=float("nan"), axes=np.full(3, np.nan))
    left, one, other = (
        np.append([np.nan] * 3, values[3:])
        for values in (trace.normalised_innovation_variance, *trace.autocorrelations)
    )
    shown = replace(trace, normalised_innovation_variance=left, autocorrelations=(one, other))
    return replace(shown, robot_before=robot, comparisons=tuple(comparisons), noise_floor=floor)
