"""What is said where no known effect suffices: a formula that earns its place, or what its residual looks like."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import log

from ...robots.robot import Robot
from ..attempts import fitter_apart
from ..data import Evidence
from ..filter_step import Noise
from ..fit import Fitter
from ..hypotheses import hypotheses
from ..search import Found
from ..verdict import Resonance
from ..workers import Workers
from .discovery import Discovery, discover
from .resonance import resonances
from .written import formula_text

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Rest:
    """A ``discovery`` if one is good enough to be tried in the FMUs, the lines of the spectrum, and notes."""

    discovery: Discovery | None = None
    resonances: tuple[Resonance, ...] = ()
    notes: tuple[str, ...] = ()


def what_is_left(
    robot: Robot,
    found: Found,
    fitter: Fitter,
    evidence: Evidence,
    alpha: float,
    progress: Progress,
    workers: Workers,
) -> Rest:
    """Of a robot whose recordings known effects do not explain; ``found`` are those that come closest."""
    apart = found.accepted and workers.processes > 1
    together = workers.start(_beside, fitter.noise, found, evidence) if apart else None
    threshold = log((len(hypotheses(robot)) + 1) / alpha)
    formula = _earned(discover(robot, (), fitter, evidence, progress), threshold)
    if formula is not None and formula.leaves_noise:
        return Rest(formula)
    # Effects that only come closest may have taken the line's place.
    lines = resonances(found.fit.robot, fitter, evidence)
    if not lines and found.accepted:
        lines = resonances(robot, fitter, evidence)
    notes = [line.sentence for line in lines]
    if formula is not None:
        said = formula_text(robot, formula.formulas)
        notes.append(f"a formula explains part of the residual, not all of it: {said}")
    if together is not None:
        progress("looking for a formula beside effects", 0.0)
        beside = together.result()
    else:
        beside = discover(found.fit.robot, found.accepted, fitter, evidence, progress) if found.accepted else None
    beside = _earned(beside, threshold)
    if beside is not None and beside.leaves_noise:
        names = " and ".join(hypothesis.label(robot) for hypothesis in found.accepted)
        said = formula_text(robot, beside.formulas)
        notes.append(f"a formula together with {names} leaves noise, but either may stand for something else: {said}")
    return Rest(None, lines, tuple(notes))


def _beside(noise: Noise, found: Found, evidence: Evidence) -> Discovery | None:
    """A formula together with what comes closest, in a process that keeps a fitter of its own."""
    return discover(found.fit.robot, found.accepted, fitter_apart(noise), evidence, lambda what, done: None)


def _earned(found: Discovery | None, threshold: float) -> Discovery | None:
    return found if found is not None and found.earns_its_place(threshold) else None
