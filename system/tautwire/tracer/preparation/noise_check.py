"""Declared noise held against the recordings: too small, too large, or not white."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, log

import numpy as np
from numpy.typing import NDArray

from ...recordings.recording import Recording
from ...robots.robot import Robot
from ..filter_step import Noise
from .spectrum_floor import is_flat, noise_levels

Array = NDArray[np.float64]

# Declared over measured, or the other way, beyond which the declared one is wrong.
CLEARLY = 1.5
# Samples of coloured noise this much alike count as independent; never fewer than one of so many is kept.
INDEPENDENT, MOST_THINNED = 0.15, 20
# A rest: winches this many sigma from still, for so many samples.
STILL, REST = 5.0, 200


@dataclass(frozen=True)
class CheckedNoise:
    """Noise to judge by; the recordings, of coloured channels only some samples; and notes."""

    noise: Noise
    recordings: tuple[Recording, ...]
    notes: tuple[str, ...]


def checked_noise(robot: Robot, noise: Noise, recordings: tuple[Recording, ...]) -> CheckedNoise:
    """Each output's declared noise beside the floor of its spectrum, or its rest.

    A floor that is half as high again as declared, or the other way, takes the place of the declared one. Where the
    spectrum falls up to its end below what is declared, the noise is coloured: of such a channel, samples are left out
    until those that stay are independent. Winch speeds may be declared noisier than they are.
    """
    checked = CheckedNoise(noise, recordings, ())
    tensions = range(3, 3 + robot.cable_count)
    if robot.sensors.position_noise is not None:
        checked = _checked_kind(checked, range(3), "m", noise.of_outputs(robot.cable_count))
    if robot.sensors.tension_noise is not None:
        checked = _checked_kind(checked, tensions, "N", checked.noise.of_outputs(robot.cable_count))
    speeds = [level for r in recordings for c in r.winch_speed.T if (level := noise_levels(c)) is not None]
    if not robot.sensors.winch_speed_noise or not speeds:
        return checked
    measured = float(np.sqrt(np.mean(speeds)))
    if not is_flat(speeds) or measured <= CLEARLY * noise.winch_speed:
        return checked
    said = _replaced("winch speeds", noise.winch_speed, measured, "m/s")
    return CheckedNoise(replace(checked.noise, winch_speed=measured), checked.recordings, (*checked.notes, said))


def _checked_kind(checked: CheckedNoise, places: range, unit: str, own: tuple[float, ...]) -> CheckedNoise:
    """The outputs in some places, which have one kind of sensor: its noise has one colour."""
    recordings, deviations, notes = checked.recordings, list(own), list(checked.notes)
    levels = {}
    for place in places:
        found = [level for r in recordings if (level := noise_levels(r.measured()[:, place])) is not None]
        if found:
            levels[place] = np.mean(found, axis=0)
    if not levels:
        return checked
    flat = is_flat(list(levels.values()))
    for place, level in levels.items():
        name = recordings[0].channel_names[place]
        floor = float(np.sqrt(np.mean(level) if flat else np.min(level)))
        if own[place] / CLEARLY <= floor <= own[place] * CLEARLY:
            continue
        if flat:
            notes.append(_replaced(name, own[place], floor, unit))
            deviations[place] = floor
        elif floor < own[place]:
            rest = _rest(recordings, place, checked.noise.winch_speed)
            step, deviations[place], how = _colour(own[place], floor, rest)
            recordings = tuple(_every(recording, place, step) for recording in recordings)
            said = f"noise is coloured ({how}; {deviations[place]:.3g} {unit} in all)"
            notes.append(f"{name}: {said}; one sample of {step} was used")
        else:
            notes.append(
                f"{name}: its spectrum stays above the declared noise, {own[place]:.3g} {unit}, and has no floor: "
                "either the noise is larger and coloured, or something fast is not resolved; the declared one is used"
            )
    if len(notes) == len(checked.notes):
        return checked
    return CheckedNoise(replace(checked.noise, own=tuple(deviations)), recordings, tuple(notes))


def _replaced(name: str, declared: float, measured: float, unit: str) -> str:
    return f"{name}: declared noise {declared:.3g} {unit}, by its spectrum's floor {measured:.3g} {unit}: that is used"


def _colour(declared: float, floor: float, rest: tuple[float, float] | None) -> tuple[int, float, str]:
    """One of how many samples to keep, their deviation, and how that is known.

    The correlation ``a`` of neighbours is that of a rest; without one, that of noise filtered to first order, whose
    spectrum ends at ``(1 - a) / (1 + a)`` of its mean.
    """
    share = (floor / declared) ** 2
    alike, deviation, how = (1.0 - share) / (1.0 + share), declared, "its spectrum falls up to its end"
    if rest is not None:
        deviation, alike = rest
        how = f"at rest neighbours are alike by {alike:.2f}"
    step = min(ceil(log(INDEPENDENT) / log(alike)), MOST_THINNED) if 0.0 < alike < 1.0 else 1
    return step, deviation, how


def _every(recording: Recording, place: int, step: int) -> Recording:
    measured = recording.measured()
    seen = np.flatnonzero(np.isfinite(measured[:, place]))
    measured[np.setdiff1d(seen, seen[::step]), place] = np.nan
    return replace(recording, position=measured[:, :3], tension=measured[:, 3:])


def _rest(recordings: Sequence[Recording], place: int, noise: float) -> tuple[float, float] | None:
    """Deviation and correlation of neighbours in the longest rest; None where winches never rest for long."""
    longest = np.zeros(0)
    for recording in recordings:
        signal = recording.measured()[:, place]
        still = np.all(np.abs(recording.winch_speed) <= STILL * noise, axis=1) & np.isfinite(signal)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            longest = signal[first:last] if last - first > len(longest) else longest
    if len(longest) < REST:
        return None
    time = np.arange(len(longest))
    left = longest - np.polyval(np.polyfit(time, longest, 1), time)
    return float(np.std(left)), float(left[1:] @ left[:-1] / max(left @ left, np.finfo(float).tiny))
