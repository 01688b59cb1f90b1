"""Recordings in MDF files (ASAM): channels named as the columns of a CSV file, each group at its own times."""

import gc
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError, at_once, shown
from ..input_file import readable_file
from .columns import ColumnTable
from .header import AXES, Header, Refuse, header_of, require_samples

SUFFIXES = (".mf4", ".mdf")
_MAGIC = b"MDF     "
_ANEW = "write it anew as MDF 4, or as CSV or Parquet under another name"
_UNITS = {"winch_speed": ("", "m/s", "m*s^-1"), "tension": ("", "N"), "position": ("", "m")}
# s: times of two groups that are closer are one.
_SAME = 1e-9


@dataclass(frozen=True)
class Channel:
    """One channel: ``time`` (N,) in s and ``values`` (N,), NaN where it was not valid."""

    time: NDArray[np.float64]
    values: NDArray[np.float64]


def is_mdf(path: str | Path) -> bool:
    """Whether a file is MDF by its name or its first bytes; raises RecordingError where it cannot be read."""
    with readable_file(path, RecordingError) as file, file.open("rb") as content:
        return file.suffix.lower() in SUFFIXES or content.read(len(_MAGIC)) == _MAGIC


def open_mdf(path: str | Path, cable_count: int, sink: Refuse = at_once) -> ColumnTable:
    """The MDF file of a recording, a row at each time of any of its channels that are read.

    Winch speeds are linear between their samples, as everywhere; an output has no value at the times of others. What
    lies before or after some winch speed is left out. Needs the package asammdf.

    Raises RecordingError where it is no MDF file, a channel is missing, there twice or no number, or a unit is not SI.
    What is wrong with the names of channels goes to the ``sink``.
    """
    file = str(path)
    try:
        from asammdf import MDF
    except ImportError as problem:
        said = "reading MDF needs the package asammdf, which is not installed"
        mend = "run pip install asammdf, or give the recording as CSV or Parquet"
        raise RecordingError(file, said, mend) from problem
    reason = ""
    with _unraised_unsaid():
        try:
            with MDF(Path(path)) as content:
                header, channels = _read(content, file, cable_count, sink)
        except RecordingError:
            raise
        # A file that is broken may raise anything there.
        except Exception as problem:
            reason = shown(str(problem), 200)
        if reason:
            gc.collect()
    if reason:
        raise RecordingError(file, f"cannot be read as MDF ({reason})", _ANEW)
    return ColumnTable(file, header, _on_one_time(channels, file))


@contextmanager
def _unraised_unsaid() -> Iterator[None]:
    """Keep Python from printing what asammdf's objects raise as they go, where their file was broken."""
    before = sys.unraisablehook
    sys.unraisablehook = lambda unraisable: None
    try:
        yield
    finally:
        sys.unraisablehook = before


def _read(content: Any, file: str, cable_count: int, sink: Refuse) -> tuple[Header, dict[str, Channel]]:
    for group in content.groups:
        require_samples(group.channel_group.cycles_nr, file)
    masters = set(content.masters_db.items())
    places = {name: [at for at in found if at not in masters] for name, found in content.channels_db.items()}
    names = [name for name, found in places.items() if found and name != "time"]
    header = header_of(["time", *names], file, cable_count, sink)
    channels = {}
    for name in header.known:
        if name == "time":
            continue
        if len(places[name]) > 1:
            raise RecordingError(f"{file}: channel {name}", "is there more than once", "keep one of them")
        group, index = places[name][0]
        channels[name] = _channel(content.get(name, group=group, index=index), f"{file}: channel {name}", name)
    return header, channels


def _channel(signal: Any, where: str, name: str) -> Channel:
    units = _UNITS["position" if name in AXES else name.rpartition("_")[0]]
    if signal.unit.strip() not in units:
        raise RecordingError(where, f"is in {shown(signal.unit)}", f"convert it to {units[1]}")
    if signal.samples.ndim != 1 or signal.samples.dtype.kind not in "iuf":
        raise RecordingError(where, "holds no numbers", "store it as a number a sample, in SI units")
    values = signal.samples.astype(np.float64)
    if signal.invalidation_bits is not None:
        values[np.asarray(signal.invalidation_bits, dtype=bool)] = np.nan
    return Channel(np.asarray(signal.timestamps, dtype=np.float64), values)


def _on_one_time(channels: Mapping[str, Channel], file: str) -> dict[str, NDArray[np.float64]]:
    """All channels as columns over the times of any."""
    inputs = [channel for name, channel in channels.items() if name.startswith("winch_speed_")]
    if not all(len(channel.time) for channel in inputs):
        raise RecordingError(file, "some winch speed has no samples", "record all of them")
    time = _merged([channel.time for channel in channels.values()])
    first, last = max(c.time[0] for c in inputs), min(c.time[-1] for c in inputs)
    time = time[(time >= first - _SAME) & (time <= last + _SAME)]
    columns = {"time": time}
    for name, channel in channels.items():
        if name.startswith("winch_speed_"):
            columns[name] = np.interp(time, channel.time, channel.values)
            continue
        columns[name] = np.full(len(time), np.nan)
        at = np.clip(np.searchsorted(time, channel.time - _SAME), 0, max(len(time) - 1, 0))
        there = np.abs(time[at] - channel.time) <= _SAME if len(time) else np.zeros(len(channel.time), dtype=bool)
        columns[name][at[there]] = channel.values[there]
    return columns


def _merged(times: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """All times, ascending, those that are the same once."""
    whole = np.unique(np.concatenate(times))
    return whole[np.append(True, np.diff(whole) > _SAME)] if len(whole) else whole
