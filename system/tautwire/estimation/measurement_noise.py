"""Measurement noise of the sensors: declared, estimated from a recording, and one tested against the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import log, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.signal import spectrogram

from ..errors import InputError
from ..recordings.quaternion_columns import rotation_vectors
from ..recordings.recording import Recording
from ..recordings.white_noise_estimate import quantization_step, white_noise_deviation
from ..robot.rigid_equilibrium import platform_size
from ..robot.schema import Robot
from .kalman_filter import Noise
from .measured_outputs import measured_outputs, output_names
from .policy import DEFAULT_POLICY
from .preprocessing_policy import NoiseCheckPolicy

Array = NDArray[np.float64]

SEGMENT_SAMPLES, MIN_SPECTRUM_SAMPLES = 64, 300
# Bands from this share of the sampling rate to half of it.
MIN_FREQUENCY_RATIO, BAND_COUNT = 0.19, 5
# A low quantile over segments: in the louder ones the robot may jolt.
QUIET_SEGMENT_QUANTILE = 0.3


def noise_levels(signal: Array) -> Array | None:
    """Variances (5,) of white noise with the spectral level of a signal in five bands; the signal (N,) is equidistant.

    The signal is NaN where not measured. None where fewer than 300 samples are, or all are the same. Spectra of second
    differences, over ``(2 sin(pi f))^4``: slow motion does not leak into them. Of segments (Welch, 1967) the 0.3
    quantile, over that of an exponential distribution, ``-ln(0.7)``.
    """
    finite = signal[np.isfinite(signal)]
    if len(finite) < MIN_SPECTRUM_SAMPLES or not np.any(np.diff(finite)):
        return None
    frequency, _, segments = spectrogram(
        np.diff(finite, 2), window="hann", nperseg=SEGMENT_SAMPLES, noverlap=SEGMENT_SAMPLES // 2
    )
    density = np.quantile(segments, QUIET_SEGMENT_QUANTILE, axis=1) / -log(1.0 - QUIET_SEGMENT_QUANTILE)
    high = frequency >= MIN_FREQUENCY_RATIO
    level = density[high] / (2.0 * np.sin(np.pi * frequency[high])) ** 4
    # The last line (Nyquist) of a one-sided spectrum is not doubled.
    level[-1] *= 2.0
    bands = np.array([0.5 * float(np.mean(band)) for band in np.array_split(level, BAND_COUNT)])
    return bands if np.all(bands > 0.0) else None


def is_flat(levels: Sequence[Array], max_band_ratio: float) -> bool:
    """Whether several spectra, each over its own mean, are flat in all bands on average."""
    shape = np.mean([level / np.mean(level) for level in levels], axis=0)
    return bool(np.max(shape) <= max_band_ratio * np.min(shape))


INITIAL_POSITION_SIGMAS = 3.0
UNMEASURED_INITIAL_DEVIATION = 1e-3
UNMEASURED_ROTATION_NOISE = 1e-3


def estimate_noise(robot: Robot, recording: Recording) -> Noise:
    """Standard deviations as declared; one that is not declared, or zero, is estimated from the recording.

    A winch speed may be declared free of noise; no position or tension is.
    """
    position = robot.sensors.position_noise or _measured_noise(recording.position)
    speed = robot.sensors.winch_speed_noise
    rotation = _rotation_noise(robot, recording) if robot.platform.is_rigid_body else None
    return Noise(
        position=position,
        tension=robot.sensors.tension_noise or _measured_noise(recording.tension),
        winch_speed=white_noise_deviation(recording.winch_speed) if speed is None else speed,
        rotation=rotation,
        moment_arm=rotation_scale(robot),
        start_rotation=INITIAL_POSITION_SIGMAS * (rotation or 0.0)
        if recording.has_orientation
        else UNMEASURED_INITIAL_DEVIATION / rotation_scale(robot),
        start_position=INITIAL_POSITION_SIGMAS * position if recording.has_position else UNMEASURED_INITIAL_DEVIATION,
    )


def _measured_noise(samples: Array) -> float:
    """Standard deviation of white noise on samples (N, k), or of their rounding where that is larger."""
    rounding = max(quantization_step(column) for column in samples.T) / sqrt(12.0)
    return max(white_noise_deviation(samples), rounding)


def declared_noise(robot: Robot) -> Noise:
    """Standard deviations as declared, for what no recording is there to estimate them from.

    Raises InputError where those of positions, tensions or, on a platform that turns, orientation are not declared.
    """
    sensors, is_rigid = robot.sensors, robot.platform.is_rigid_body
    needed = ["position_noise", "tension_noise", *(["orientation_noise"] if is_rigid else [])]
    missing = [name for name in needed if not getattr(sensors, name)]
    if missing:
        raise InputError(
            f"[sensors] of {robot.name}",
            f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} not declared",
            "declare the standard deviation of one reading, a large one for a sensor that the robot lacks",
        )
    position, rotation = sensors.position_noise or 0.0, sensors.orientation_noise if is_rigid else None
    return Noise(
        position=position,
        tension=sensors.tension_noise or 0.0,
        winch_speed=sensors.winch_speed_noise or 0.0,
        rotation=rotation,
        moment_arm=rotation_scale(robot),
        start_rotation=INITIAL_POSITION_SIGMAS * (rotation or 0.0),
        start_position=INITIAL_POSITION_SIGMAS * position,
    )


def _rotation_noise(robot: Robot, recording: Recording) -> float:
    """Standard deviation of a measured rotation about each axis, in rad."""
    if robot.sensors.orientation_noise:
        return robot.sensors.orientation_noise
    if not recording.has_orientation:
        return UNMEASURED_ROTATION_NOISE
    return white_noise_deviation(rotation_vectors(recording.orientation))


def rotation_scale(robot: Robot) -> float:
    """Length in m by which forces and motion of a platform become moments and rotations; 1 for a point mass."""
    return platform_size(robot) if robot.platform.is_rigid_body else 1.0


@dataclass(frozen=True)
class CheckedNoise:
    """Noise after the test, whether some output's noise ``is_coloured``, and notes."""

    noise: Noise
    is_coloured: bool = False
    notes: tuple[str, ...] = ()


def check_noise(
    robot: Robot,
    noise: Noise,
    recordings: tuple[Recording, ...],
    policy: NoiseCheckPolicy = DEFAULT_POLICY.preprocessing.noise_check,
) -> CheckedNoise:
    """Test each output's declared noise against the white floor of its spectrum, or against a standstill.

    A floor 1.5 times the declared standard deviation or more, or less than 1 / 1.5 of it, replaces the declared one.
    Where the spectrum falls to its end below the declared level, the noise is coloured, and a disturbance has to be
    estimated, as where too few digits were recorded. Winch speeds may be declared noisier than they are.
    """
    checked = CheckedNoise(noise)
    positions, tensions = range(3), range(3, 3 + robot.cable_count)
    rotations = range(tensions.stop, tensions.stop + 3)
    if robot.sensors.position_noise is not None:
        checked = _check_sensor_kind(checked, recordings, positions, "m", policy)
    if robot.sensors.tension_noise is not None:
        checked = _check_sensor_kind(checked, recordings, tensions, "N", policy)
    if robot.platform.is_rigid_body and robot.sensors.orientation_noise is not None:
        checked = _check_sensor_kind(checked, recordings, rotations, "rad", policy)
    speed_levels = [level for r in recordings for c in r.winch_speed.T if (level := noise_levels(c)) is not None]
    if not robot.sensors.winch_speed_noise or not speed_levels:
        return checked
    measured = float(np.sqrt(np.mean(speed_levels)))
    if not is_flat(speed_levels, policy.max_band_ratio) or measured <= policy.max_noise_ratio * noise.winch_speed:
        return checked
    note = f"winch speeds: {_replacement_finding(noise.winch_speed, measured, 'm/s')}"
    return replace(checked, noise=replace(checked.noise, winch_speed=measured), notes=(*checked.notes, note))


def _check_digits(
    checked: CheckedNoise, recordings: tuple[Recording, ...], columns: range, unit: str, policy: NoiseCheckPolicy
) -> CheckedNoise:
    """Take no noise for less than what rounding adds, step / sqrt(12), which has a memory where motion is slow."""
    count = recordings[0].cable_count
    is_coloured, deviations = checked.is_coloured, list(checked.noise.of_outputs(count))
    outputs_by_finding: dict[str, list[str]] = {}
    for column in columns:
        step = max(quantization_step(_signal(recording, column)) for recording in recordings)
        rounding, declared = step / sqrt(12.0), deviations[column]
        if rounding > policy.max_noise_ratio * declared:
            is_coloured, deviations[column] = True, rounding
            finding = (
                f"values are in steps of {step:.3g} {unit}, where noise of {declared:.3g} {unit} is declared: record "
                f"more digits; {rounding:.3g} {unit} is used, and its memory is estimated with the disturbance"
            )
            outputs_by_finding.setdefault(finding, []).append(output_names(count, is_rigid=True)[column])
    return _with_findings(replace(checked, is_coloured=is_coloured), deviations, outputs_by_finding)


def _with_findings(
    checked: CheckedNoise, deviations: Sequence[float], outputs_by_finding: Mapping[str, Sequence[str]]
) -> CheckedNoise:
    if not outputs_by_finding:
        return checked
    notes = [f"{', '.join(outputs)}: {finding}" for finding, outputs in outputs_by_finding.items()]
    noise = replace(checked.noise, own=tuple(deviations))
    return replace(checked, noise=noise, notes=(*checked.notes, *notes))


def _check_sensor_kind(
    checked: CheckedNoise, recordings: tuple[Recording, ...], columns: range, unit: str, policy: NoiseCheckPolicy
) -> CheckedNoise:
    """Test the outputs of one kind of sensor, whose noise has one colour."""
    count = recordings[0].cable_count
    stated = checked.noise.of_outputs(count)
    checked = _check_digits(checked, recordings, columns, unit, policy)
    outputs_by_finding: dict[str, list[str]] = {}
    is_coloured = checked.is_coloured
    declared = checked.noise.of_outputs(count)
    deviations, levels = list(declared), _spectral_levels(recordings, columns)
    if not levels:
        return checked
    flat = is_flat(list(levels.values()), policy.max_band_ratio)
    for column, level in levels.items():
        floor = float(np.sqrt(np.mean(level) if flat else np.min(level)))
        is_rounding = declared[column] > stated[column]
        if is_rounding and floor <= declared[column] * policy.max_noise_ratio:
            continue
        if not flat and floor < declared[column] / policy.min_colour_ratio:
            standstill = _standstill_statistics(recordings, column, checked.noise.winch_speed, policy)
            deviations[column] = standstill[0] if standstill else declared[column]
            basis = (
                f"at rest neighbouring samples correlate by {standstill[1]:.2f}"
                if standstill
                else "the spectrum falls up to the Nyquist frequency"
            )
            origin = "at rest" if standstill else "as declared"
            description = f"noise is coloured ({basis}; {deviations[column]:.3g} {unit} {origin})"
            finding = f"{description}; its memory is estimated with the disturbance"
            is_coloured = True
        elif declared[column] / policy.max_noise_ratio <= floor <= declared[column] * policy.max_noise_ratio:
            continue
        elif flat:
            finding = _replacement_finding(declared[column], floor, unit)
            deviations[column] = floor
        else:
            finding = (
                f"the spectrum is above the declared noise, {declared[column]:.3g} {unit}, and has no floor: either "
                "the noise is larger and coloured, or the sampling misses fast motion; the declared noise is used"
            )
        outputs_by_finding.setdefault(finding, []).append(output_names(count, is_rigid=True)[column])
    return _with_findings(replace(checked, is_coloured=is_coloured), deviations, outputs_by_finding)


def _spectral_levels(recordings: Sequence[Recording], columns: Sequence[int]) -> dict[int, Array]:
    """Mean of :func:`noise_levels` over recordings, of each output that has any."""
    levels = {}
    for column in columns:
        spectra = [level for r in recordings if (level := noise_levels(_signal(r, column))) is not None]
        if spectra:
            levels[column] = np.mean(spectra, axis=0)
    return levels


def _signal(recording: Recording, column: int) -> Array:
    """One output (N,); of orientations a rotation from the first."""
    return measured_outputs(recording, is_rigid=True)[:, column]


def _replacement_finding(declared: float, measured: float, unit: str) -> str:
    return f"declared noise {declared:.3g} {unit}, spectral noise floor {measured:.3g} {unit}: the latter is used"


def _standstill_statistics(
    recordings: Sequence[Recording], column: int, winch_speed_noise: float, policy: NoiseCheckPolicy
) -> tuple[float, float] | None:
    """Standard deviation and lag-one autocorrelation in the longest standstill; None without one long enough."""
    longest = np.zeros(0)
    for recording in recordings:
        signal = _signal(recording, column)
        at_rest = np.all(np.abs(recording.winch_speed) <= policy.standstill_sigmas * winch_speed_noise, axis=1)
        is_at_standstill = at_rest & np.isfinite(signal)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], is_at_standstill.astype(int), [0]])))
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            longest = signal[first:last] if last - first > len(longest) else longest
    if len(longest) < policy.min_standstill_samples:
        return None
    time = np.arange(len(longest))
    residual = longest - np.polyval(np.polyfit(time, longest, 1), time)
    return float(np.std(residual)), float(residual[1:] @ residual[:-1] / max(residual @ residual, np.finfo(float).tiny))
