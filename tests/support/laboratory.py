"""Recordings as laboratories write them: the shipped one in other units, orders, frames, dialects and clocks."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from tautwire.cli.input_checks import check_files
from tests.support.robots import EXAMPLES

ROBOT = (EXAMPLES / "three" / "robot.toml").read_text(encoding="utf-8")
ROWS = 800
AXES, CELLS = ["x", "y", "z"], ["tension_1", "tension_2", "tension_3"]
SPEEDS = ["winch_speed_1", "winch_speed_2", "winch_speed_3"]

Frame = pd.DataFrame
Writer = Callable[[Frame], str | bytes]


def standard() -> Frame:
    """The first samples of the shipped recording, with the columns of a recording file alone."""
    frame = pd.read_csv(EXAMPLES / "three" / "fit.csv", nrows=ROWS)
    return frame[["time", *SPEEDS, *CELLS, *AXES]]


def text_of(frame: Frame, separator: str = ",", decimal: str = ".", header: bool = True, end: str = "\n") -> str:
    buffer = io.StringIO()
    frame.to_csv(buffer, sep=separator, decimal=decimal, index=False, header=header, lineterminator=end)
    return buffer.getvalue()


def scaled(columns: list[str], factor: float) -> Writer:
    """The columns in another unit, and nothing that says so."""
    return lambda frame: text_of(frame.assign(**{name: frame[name] * factor for name in columns}))


def stated(columns: list[str], factor: float, unit: str, pattern: str = "{} [{}]") -> Writer:
    """The columns in another unit, with the unit beside their names."""
    names = {name: pattern.format(name, unit) for name in columns}
    changed = scaled(columns, factor)
    return lambda frame: text_of(pd.read_csv(io.StringIO(str(changed(frame)))).rename(columns=names))


def reordered(columns: list[str], order: list[int]) -> Writer:
    """Columns that hold one another's numbers."""
    return lambda frame: text_of(frame.assign(**{a: frame[columns[k]] for a, k in zip(columns, order, strict=True)}))


def above(*lines: str) -> Writer:
    return lambda frame: "\n".join([*lines, text_of(frame)])


def with_lines(change: Callable[[list[str]], list[str]]) -> Writer:
    return lambda frame: "\n".join(change(text_of(frame).split("\n")))


def with_clock(form: str) -> Writer:
    begin = pd.Timestamp("2026-05-04T23:59:58")
    times = {
        "iso": lambda t: (begin + t).isoformat() + "Z",
        "clock": lambda t: f"10:00:{t.total_seconds():06.3f}",
        "midnight": lambda t: str((begin + t).time()),
        "points": lambda t: f"{begin + t:%d.%m.%Y %H:%M:%S.%f}",
        "slashes": lambda t: f"{begin + t:%m/%d/%Y %I:%M:%S.%f %p}",
        "minutes": lambda t: f"{begin + t:%M:%S.%f}",
        "colon": lambda t: f"{begin + t:%H:%M:%S}:{(begin + t).microsecond // 1000:03d}",
        "matlab": lambda t: f"{begin + t:%d-%b-%Y %H:%M:%S.%f}",
        "year first": lambda t: f"{begin + t:%Y/%m/%d %H:%M:%S.%f}",
        "short year": lambda t: f"{begin + t:%d.%m.%y %H:%M:%S.%f}",
    }

    def write(frame: Frame) -> str:
        shown = [times[form](pd.Timedelta(round(1e3 * (seconds - frame.time[0])), unit="ms")) for seconds in frame.time]
        return text_of(frame.assign(time=shown))

    return write


def labview(frame: Frame) -> str:
    """A file of LabVIEW (.lvm): two headers, and a last column of comments for which lines have no cell."""
    ends = "***End_of_Header***"
    above = ["LabVIEW Measurement\t", "Separator\tTab", "X_Columns\tOne", "Date\t2026/05/04", ends, "\t"]
    above += ["Channels\t9", "Samples" + "\t800" * 9, "Delta_X" + "\t0.01" * 9, ends + "\t" * 10]
    names, *samples = text_of(frame, "\t").split("\n")
    return "\n".join([*above, f"{names}\tComment", *samples])


def turned(frame: Frame) -> str:
    """Positions in a tracker's frame that is turned by 30 degrees about z."""
    cosine, sine = np.cos(np.radians(30.0)), np.sin(np.radians(30.0))
    return text_of(frame.assign(x=cosine * frame.x - sine * frame.y, y=sine * frame.x + cosine * frame.y))


def tared(frame: Frame) -> str:
    return text_of(frame.assign(**{cell: frame[cell] - frame[cell][:10].mean() for cell in CELLS}))


def of_one_cable(column: str, change: Callable[[pd.Series], pd.Series]) -> Writer:
    """One column whose numbers are others."""
    return lambda frame: text_of(frame.assign(**{column: change(frame[column])}))


def as_lengths(factor: float) -> Writer:
    """The lengths that encoders tell, in place of speeds."""

    def write(frame: Frame) -> str:
        reeled = (frame[SPEEDS].rolling(2).mean().mul(frame["time"].diff(), axis=0)).fillna(0.0).cumsum()
        lengths = {f"rope_length_{cable}": -factor * reeled[name] for cable, name in enumerate(SPEEDS, 1)}
        return text_of(frame.drop(columns=SPEEDS).assign(**lengths).round(9))

    return write


def tracker_late(frame: Frame) -> str:
    rows = round(0.8 / (frame.time[1] - frame.time[0]))
    late = frame[[*AXES, *CELLS]].shift(-rows)
    return text_of(frame.assign(**{name: late[name] for name in late}).iloc[:-rows])


def empty_speeds(count: int) -> Writer:
    def write(frame: Frame) -> str:
        changed = frame.copy()
        changed.loc[100 : 99 + count, "winch_speed_2"] = np.nan
        return text_of(changed)

    return write


def lost_positions(value: float) -> Writer:
    """A tracker that writes one number for all coordinates where it has lost the platform."""
    return lambda frame: text_of(
        frame.assign(**{axis: frame[axis].where(frame.index % 400 < 370, value) for axis in AXES})
    )


@dataclass(frozen=True)
class Laboratory:
    """A folder with the robot file and one recording."""

    folder: Path

    def problems(self, content: str | bytes) -> list[str]:
        recording = self.recording(content)
        checked = check_files(self.robot(ROBOT), recording)
        return [str(problem) for problem in checked.problems]

    def robot(self, text: str) -> Path:
        path = self.folder / "robot.toml"
        path.write_text(text, encoding="utf-8")
        return path

    def recording(self, content: str | bytes) -> Path:
        path = self.folder / "log.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path
