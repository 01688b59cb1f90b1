"""A lifelike case from a seed: robot file, FIT, CHECK, and the truth about them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tests.rig.lifelike.design import Design, design
from tests.rig.lifelike.hidden import HIDDEN, HIDDEN_ON_PLATFORMS, Hidden, Site, names_of
from tests.rig.lifelike.little import little_of, no_little
from tests.rig.lifelike.platform_design import platform_design
from tests.rig.lifelike.recording import Lot, Outputs, Session
from tests.rig.lifelike.survey import NOTHING_UNKNOWN, robot_file, survey_of, true_robot
from tests.rig.record import write_recording

ROLES = ("fit", "check")
DURATION, RATE = 40.0, 100.0
# Sizes are found on the first seconds of FIT.
SIZING = 15.0
# How much more than the little things a hidden one changes positions or tensions.
RATIOS = (6.0, 40.0)
LEAST_RATIO, MOST_RATIO = 3.0, 80.0
TRIES = 5
ROBOTS = 12
# Of the usual tension: no rope comes closer to hanging loose, but where slackness is hidden.
TIGHT = 0.05


@dataclass(frozen=True)
class Case:
    """What a seed gives."""

    robot_file: str
    recordings: dict[str, pd.DataFrame]
    truth: dict[str, Any]

    def write(self, folder: Path) -> None:
        """robot.toml, fit.csv, check.csv and truth.json; the truth comes last."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "robot.toml").write_text(self.robot_file, encoding="utf-8")
        for role, frame in self.recordings.items():
            write_recording(frame, folder / f"{role}.csv")
        (folder / "truth.json").write_text(json.dumps(self.truth, indent=1) + "\n", encoding="utf-8")


def lifelike(
    seed: int,
    hide: Sequence[str] = (),
    *,
    cables: int | None = None,
    planar: bool | None = None,
    duration: float = DURATION,
    rate: float = RATE,
    turning: bool = False,
    exact: bool = False,
) -> Case:
    """A robot by lot that hides the things of these keys (see HIDDEN), or nothing, in two recordings.

    With `turning` it has a platform that turns, on 4 or 8 cables (see HIDDEN_ON_PLATFORMS). Of an `exact` one nothing
    is uncertain, and there is nothing little but white noise.

    Robots on which they do not show enough, or ropes come loose, are drawn anew. ValueError if none of a dozen will do.
    """
    parts = tuple((HIDDEN_ON_PLATFORMS if turning else HIDDEN)[key] for key in hide)
    for number in range(ROBOTS):
        random = np.random.default_rng([seed, number])
        made = platform_design(random, cables or 8) if turning else design(random, cables, planar)
        try:
            return _case(seed, random, made, parts, duration, rate, exact)
        except UnsuitableError:
            continue
    raise ValueError(f"no robot of seed {seed} shows {'+'.join(hide)}")


class UnsuitableError(Exception):
    """A robot on which something does not show, or whose ropes come loose."""


@dataclass(frozen=True)
class _Hiding:
    """Parts with their strengths."""

    parts: tuple[Hidden, ...]
    strengths: tuple[float, ...]
    lot: Lot
    cable: int
    signs: tuple[float, ...]

    def settings(self, session: Session, duration: float) -> dict[str, Any]:
        """Values of the rig in one session."""
        results: dict[str, Any] = {}
        for index, part in enumerate(self.parts):
            random = session.random(10 + index)
            site = Site(self.lot.design, self.lot.survey, self.cable, self.signs[index], duration, random)
            results[part.name] = part.settings(self.strengths[index], site)
        return results


def _case(
    seed: int,
    random: np.random.Generator,
    made: Design,
    parts: tuple[Hidden, ...],
    duration: float,
    rate: float,
    exact: bool,
) -> Case:
    survey = NOTHING_UNKNOWN if exact else survey_of(random, made)
    little = no_little() if exact else little_of(random, made, survey, names_of(parts))
    if little.counts:
        noise = replace(made.robot.noise, winch_speed=float(f"{0.2 * little.counts * rate:.2g}"))
        made = replace(made, robot=replace(made.robot, noise=noise))
    lot = Lot(made, survey, true_robot(random, made, survey), little)
    seeds = {role: int(random.integers(2**31)) for role in ROLES}
    cable, signs = int(random.integers(made.robot.count)) + 1, tuple(random.choice([-1.0, 1.0], len(parts)).tolist())
    hiding = _Hiding(parts, tuple(part.least for part in parts), lot, cable, signs)
    hiding = _sized(random, hiding, Session(lot, seeds["fit"], min(SIZING, duration), rate))
    recordings, sizes, littles = {}, {}, {}
    for role in ROLES:
        session = Session(lot, seeds[role], duration, rate)
        hidden = hiding.settings(session, duration)
        without = session.outputs({})
        happened = session.outputs(hidden) if parts else without
        _keep_tight(hiding, happened)
        recordings[role] = session.log(happened)
        sizes[role] = happened.apart(without)
        littles[role] = _with_memory(lot, without.apart(session.outputs({}, little=False)))
    if parts and not LEAST_RATIO <= _ratio(sizes["check"], littles["check"]) <= MOST_RATIO:
        raise UnsuitableError
    settings = hiding.settings(session, duration)
    truth = {
        **_called(parts),
        "minor": sorted(little.names),
        "parameters": settings,
        "forms": [part.key for part in parts],
        "strengths": list(hiding.strengths),
        "little": _document(lot),
        "robot": lot.truth.document(made.robot),
        "cables": made.robot.count,
        "seed": seed,
        "size_of_hidden_rms": sizes,
        "size_of_little_rms": littles,
    }
    return Case(robot_file(made, survey, made.robot.name), recordings, truth)


def _sized(random: np.random.Generator, hiding: _Hiding, session: Session) -> _Hiding:
    """With strengths that show as much as the lot says, each part alone against the little things."""
    target = float(np.exp(random.uniform(*np.log(RATIOS))))
    if not hiding.parts:
        return hiding
    plain = session.outputs({}, little=False)
    little = _with_memory(session.lot, session.outputs({}).apart(plain))
    strengths = []
    for index, part in enumerate(hiding.parts):
        strength = float(np.sqrt(part.least * min(part.most, 10.0 * part.least)))
        for _ in range(TRIES):
            tried = replace(hiding, parts=(part,), strengths=(strength,), signs=(hiding.signs[index],))
            ratio = _tried(tried, session, plain, little)
            wanted = float(np.clip(strength * (target / ratio if ratio else 0.3), part.least, part.most))
            if ratio and 0.8 < wanted / strength < 1.25:
                break
            if not ratio and strength == part.least:
                raise UnsuitableError
            strength = wanted
        if not LEAST_RATIO <= ratio <= MOST_RATIO:
            raise UnsuitableError
        strengths.append(float(f"{strength:.4g}"))
    return replace(hiding, strengths=tuple(strengths))


def _tried(hiding: _Hiding, session: Session, plain: Outputs, little: tuple[float, float]) -> float:
    """How much more than the little things it shows; 0 where ropes come loose."""
    try:
        happened = session.outputs(hiding.settings(session, session.duration), little=False)
        _keep_tight(hiding, happened)
    except (ValueError, UnsuitableError, FloatingPointError):
        return 0.0
    return _ratio(happened.apart(plain), little)


def _keep_tight(hiding: _Hiding, happened: Outputs) -> None:
    """Raise UnsuitableError where a rope comes close to hanging loose."""
    free = any(part.name == "slack" for part in hiding.parts)
    if not free and happened.tension.min() < TIGHT * hiding.lot.design.usual_tension:
        raise UnsuitableError


def _ratio(size: tuple[float, float], little: tuple[float, float]) -> float:
    return max(size[0] / little[0], size[1] / little[1])


def _with_memory(lot: Lot, size: tuple[float, float]) -> tuple[float, float]:
    """Together with the part of the sensors' noise that has a memory, or where all is exact a tenth of all noise."""
    noise, little = lot.design.robot.noise, lot.little
    place, cell = little.place.rms or 0.1 * noise.position, little.cell.rms or 0.1 * noise.tension
    return float(np.hypot(size[0], place)), float(np.hypot(size[1], cell))


def _called(parts: tuple[Hidden, ...]) -> dict[str, Any]:
    """What is hidden, how, and which answers are right."""
    names = names_of(parts)
    if not parts:
        return {"effect": "none", "accept": ["none"], "manner": "none"}
    manner = parts[0].manner if len(parts) == 1 else "pair"
    if manner == "unlisted":
        effect = f"unlisted: {parts[0].key}"
        return {"effect": effect, "accept": ["discovered", "unexplained"], "manner": manner}
    return {"effect": "+".join(names), "accept": list(names), "manner": manner}


def _document(lot: Lot) -> dict[str, Any]:
    """The little things, without those that are not there."""
    content = asdict(lot.little)
    content.update(content.pop("settings"))
    return {key: value for key, value in content.items() if value}
