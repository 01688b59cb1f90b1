"""Recordings in MDF files (ASAM): channels named as the columns of a CSV file, each group with its own time base."""

import gc
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError, format_value, raise_error
from ..input_files import readable_file
from .column_map import ColumnMap
from .recording_table import ColumnTable, ErrorSink, Header, parse_header, require_samples
from .units import Unit, units_in_words
from .winch_gaps import interpolated_at

MDF_SUFFIXES = (".mf4", ".mdf")
_MDF_MAGIC = b"MDF     "
_REWRITE_HINT = "export it again as MDF 4, or as CSV or Parquet under another name"
_INPUTS = ("winch_speed_", "rope_length_")
# s: times of two groups that are closer than this coincide.
_TIME_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Channel:
    """One channel: ``time`` (N,) in s and ``values`` (N,), NaN where it was not valid."""

    time: NDArray[np.float64]
    values: NDArray[np.float64]


def is_mdf(path: str | Path) -> bool:
    """Whether a file is MDF by its name or its first bytes; raises RecordingError where it cannot be read."""
    with readable_file(path, RecordingError) as file, file.open("rb") as content:
        return file.suffix.lower() in MDF_SUFFIXES or content.read(len(_MDF_MAGIC)) == _MDF_MAGIC


def open_mdf(path: str | Path, columns: ColumnMap, sink: ErrorSink = raise_error) -> ColumnTable:
    """Open the MDF file of a recording, as a table with a row at each sample time of any channel that is read.

    Winch speeds are interpolated linearly over up to five missing samples; an output has no value at the sample times
    of others. Times that some winch speed does not cover are omitted. Needs the package asammdf.

    Raises RecordingError where it is no MDF file, a channel is missing, duplicate, not numeric or without rising times,
    or a unit is not known.
    Errors in the names of channels go to the ``sink``.
    """
    file = str(path)
    try:
        from asammdf import MDF
    except ImportError as problem:
        message = "reading MDF needs the package asammdf, which is not installed"
        hint = "run pip install asammdf, or give the recording as CSV or Parquet"
        raise RecordingError(file, message, hint) from problem
    reason = ""
    with _suppress_unraisable():
        try:
            with MDF(Path(path)) as content:
                header, channels = _read_channels(content, file, columns.without_time(), sink)
        except RecordingError:
            raise
        # asammdf may raise anything on a corrupt file.
        except Exception as problem:
            reason = format_value(str(problem), 200)
        if reason:
            gc.collect()
    if reason:
        raise RecordingError(file, f"cannot be read as MDF ({reason})", _REWRITE_HINT)
    return ColumnTable(file, header, _align_on_common_time(channels, file))


@contextmanager
def _suppress_unraisable() -> Iterator[None]:
    """Suppress unraisable exceptions, which asammdf's objects raise in destructors after reading a corrupt file."""
    previous_hook = sys.unraisablehook
    sys.unraisablehook = lambda unraisable: None
    try:
        yield
    finally:
        sys.unraisablehook = previous_hook


def _read_channels(content: Any, file: str, columns: ColumnMap, sink: ErrorSink) -> tuple[Header, dict[str, Channel]]:
    for group in content.groups:
        require_samples(group.channel_group.cycles_nr, file)
    masters = set(content.masters_db.items())
    locations = {
        name: [location for location in candidates if location not in masters]
        for name, candidates in content.channels_db.items()
    }
    names = [name for name, channel_locations in locations.items() if channel_locations and name != "time"]
    standard_names = columns.renamed(["time", *names], file)
    header = parse_header(standard_names, file, columns.cable_count, sink)
    stored = dict(zip(standard_names, ["time", *names], strict=True))
    signals: dict[str, Any] = {}
    stated: dict[str, Unit] = {}
    for name in header.known_names:
        if name == "time":
            continue
        where = f"{file}: channel {stored[name]}"
        if len(locations[stored[name]]) > 1:
            raise RecordingError(where, "appears more than once", "keep one of them")
        group, index = locations[stored[name]][0]
        if group not in content.masters_db:
            raise RecordingError(where, "has no times", "record it in a group with a master channel of time")
        signals[name] = content.get(stored[name], group=group, index=index)
        text = signals[name].unit
        unit = columns.stated_unit(name, text, where) if text.strip() else None
        stated |= {name: unit} if unit else {}
    units = columns.units(stated, file)
    scaled = replace(header, units=units, scales=columns.scales)
    channels = {
        name: _channel(signal, name, scaled, f"{file}: channel {stored[name]}") for name, signal in signals.items()
    }
    header = replace(header, dialect=units_in_words(units), has_time_column=False)
    return header.with_recorded_columns(scaled), channels


def _channel(signal: Any, name: str, scaled: Header, where: str) -> Channel:
    if signal.samples.ndim != 1 or signal.samples.dtype.kind not in "iuf":
        raise RecordingError(where, "contains no numbers", "store one number per sample, in SI units")
    time = np.asarray(signal.timestamps, dtype=np.float64)
    if (np.diff(time) <= 0.0).any():
        sample = int(np.argmax(np.diff(time) <= 0.0)) + 1
        problem = f"its time {time[sample]:.9g} s at sample {sample + 1} does not come after {time[sample - 1]:.9g} s"
        raise RecordingError(where, problem, "times must rise: cut the recording there")
    values = scaled.to_si(name, signal.samples.astype(np.float64))
    if signal.invalidation_bits is not None:
        values[np.asarray(signal.invalidation_bits, dtype=bool)] = np.nan
    return Channel(time, values)


def _align_on_common_time(channels: Mapping[str, Channel], file: str) -> dict[str, NDArray[np.float64]]:
    """Align all channels as columns on one time base, the union of their sample times."""
    inputs = [channel for name, channel in channels.items() if name.startswith(_INPUTS)]
    if not all(len(channel.time) for channel in inputs):
        raise RecordingError(file, "some winch speed has no samples", "record all of them")
    time = _merged_times([channel.time for channel in channels.values()])
    first, last = max(c.time[0] for c in inputs), min(c.time[-1] for c in inputs)
    time = time[(time >= first - _TIME_TOLERANCE) & (time <= last + _TIME_TOLERANCE)]
    columns = {"time": time}
    for name, channel in channels.items():
        if name.startswith(_INPUTS):
            columns[name] = interpolated_at(time, channel.time, channel.values, _TIME_TOLERANCE)
            continue
        columns[name] = np.full(len(time), np.nan)
        indices = np.clip(np.searchsorted(time, channel.time - _TIME_TOLERANCE), 0, max(len(time) - 1, 0))
        coincides = (
            np.abs(time[indices] - channel.time) <= _TIME_TOLERANCE
            if len(time)
            else np.zeros(len(channel.time), dtype=bool)
        )
        columns[name][indices[coincides]] = channel.values[coincides]
    return columns


def _merged_times(times: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Union of all times, ascending; times that coincide within the tolerance are merged."""
    unique_times = np.unique(np.concatenate(times))
    return unique_times[np.append(True, np.diff(unique_times) > _TIME_TOLERANCE)] if len(unique_times) else unique_times
