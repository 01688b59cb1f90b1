"""Makes the two recordings of a case, once, as files whose names tell nothing."""

from __future__ import annotations

from pathlib import Path

from tautwire.recordings.recording import Recording, read_recording
from tests.rig import make_recording

from .cases import Case
from .motion import declared, program_of
from .sizes import strengths

ROLES = ("fit", "check")


def recordings(case: Case, folder: Path) -> tuple[Recording, Recording]:
    """FIT and CHECK of a case; files of an earlier call serve again while nothing that makes them changed."""
    effects = case.effects(strengths(case))
    place = folder / case.fingerprint(effects)
    place.mkdir(parents=True, exist_ok=True)
    count = declared(case.robot).count
    fit, check = (_recording(case, role, effects, place / f"{role}.parquet", count) for role in ROLES)
    return fit, check


def _recording(case: Case, role: str, effects: dict[str, object], path: Path, count: int) -> Recording:
    if not path.exists():
        motion, seed = case.motion, case.seed(role)
        frame = make_recording(
            declared(case.robot),
            effects,
            program_of(case.robot, motion, seed),
            duration=motion.duration,
            rate=motion.rate,
            seed=seed,
        )
        unfinished = path.with_suffix(".part")
        frame.to_parquet(unfinished)
        unfinished.replace(path)
    return read_recording(path, count)
