"""Files as laboratories have them: `check` reads each right, or refuses it and names the cause."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tautwire.cli.input_checks import check_files
from tautwire.recordings.recording import read_recording
from tests.support.laboratory import (
    AXES,
    CELLS,
    ROBOT,
    ROWS,
    SPEEDS,
    Laboratory,
    Writer,
    above,
    as_lengths,
    empty_speeds,
    labview,
    lost_positions,
    of_one_cable,
    reordered,
    scaled,
    standard,
    stated,
    tared,
    text_of,
    tracker_late,
    turned,
    with_clock,
    with_lines,
)
from tests.support.robots import EXAMPLES

READ: dict[str, Writer] = {
    "the standard": text_of,
    "columns in another order": lambda frame: text_of(frame[frame.columns[::-1]]),
    "a column that nobody knows": lambda frame: text_of(frame.assign(status="ok")),
    "semicolons": lambda frame: text_of(frame, ";"),
    "semicolons and decimal commas": lambda frame: text_of(frame, ";", ","),
    "bars": lambda frame: text_of(frame, "|"),
    "no end of the last line": lambda frame: text_of(frame).rstrip("\n"),
    "columns of equal width": with_lines(
        lambda lines: [",".join(f"{cell:>20}" for cell in line.split(",")) if line else "" for line in lines]
    ),
    "the separator in the first line": lambda frame: "sep=;\n" + text_of(frame, ";"),
    "a column of row numbers": lambda frame: str(frame.to_csv(lineterminator="\n")),
    "positions in inches that say so": stated(AXES, 1.0 / 0.0254, "inches"),
    "tabs": lambda frame: text_of(frame, "\t"),
    "tabs and decimal commas": lambda frame: text_of(frame, "\t", ","),
    "spaces": lambda frame: text_of(frame, " "),
    "Windows line ends": lambda frame: text_of(frame, end="\r\n"),
    "old line ends": lambda frame: text_of(frame, end="\r"),
    "byte order mark": lambda frame: b"\xef\xbb\xbf" + text_of(frame).encode(),
    "UTF-16": lambda frame: text_of(frame).encode("utf-16"),
    "comments above": above("# robot three", "# payload: none"),
    "comments among samples": with_lines(lambda lines: [*lines[:50], "# paused here", *lines[50:]]),
    "header that is a comment": lambda frame: "# " + text_of(frame),
    "header that is a MATLAB comment": lambda frame: "% " + text_of(frame),
    "text above the header": above("Exported by logger 4.2", "Date;2026-05-04"),
    "a line of units": with_lines(lambda lines: [lines[0], "s,m/s,m/s,m/s,N,N,N,m,m,m", *lines[1:]]),
    "blank lines": with_lines(lambda lines: [lines[0], "", *lines[1:300], "", *lines[300:]]),
    "a separator at the end of lines": with_lines(lambda lines: [line + "," if line else "" for line in lines]),
    "numbers in quotation marks": with_lines(
        lambda lines: [",".join(f'"{cell}"' for cell in line.split(",")) if line else "" for line in lines]
    ),
    "time in ms that says so": stated(["time"], 1e3, "ms"),
    "positions in mm that say so": stated(AXES, 1e3, "mm", "{} ({})"),
    "tensions in kN that say so": stated(CELLS, 1e-3, "kN", "{} / {}"),
    "speeds in mm/s that say so": stated(SPEEDS, 1e3, "mm/s"),
    "micrometres in Latin-1": lambda frame: str(stated(AXES, 1e6, "\u00b5m")(frame)).encode("latin-1"),
    "a raw column beside the one that is read": lambda frame: text_of(frame.assign(**{"x (raw)": 0.0})),
    "columns that nobody knows, of one name": with_lines(
        lambda lines: [f"{lines[0]},aux,aux", *(f"{line},1,2" if line else "" for line in lines[1:])]
    ),
    "names in two lines": with_lines(
        lambda lines: [
            f"{',' * 10}Hook,,Box,",
            f"{lines[0]},X,Y,X,Y",
            *(f"{line},1,2,3,4" for line in lines[1:] if line),
        ]
    ),
    "columns in the text above": above("Recorded channels: time x y z"),
    "ISO 8601 over midnight": with_clock("iso"),
    "clock times": with_clock("clock"),
    "clock times over midnight": with_clock("midnight"),
    "German dates over midnight": with_clock("points"),
    "American dates over midnight": with_clock("slashes"),
    "minutes of a spreadsheet over the hour": with_clock("minutes"),
    "milliseconds behind a colon": with_clock("colon"),
    "dates of MATLAB": with_clock("matlab"),
    "dates with slashes, the year first": with_clock("year first"),
    "German dates of a short year": with_clock("short year"),
    "UTF-16 without its mark": lambda frame: text_of(frame).encode("utf-16-le"),
    "two byte order marks": lambda frame: 2 * b"\xef\xbb\xbf" + text_of(frame).encode(),
    "a file of LabVIEW, whose comments have no cell": labview,
}

REFUSED: dict[str, tuple[Writer, str]] = {
    "time in ms": (scaled(["time"], 1e3), "time is in ms"),
    "time in us": (scaled(["time"], 1e6), "time is in us"),
    "row numbers as times": (
        lambda f: text_of(f.assign(time=range(len(f)))),
        "its factor is the time between samples in s, about 0.01",
    ),
    "speeds in mm/s": (scaled(SPEEDS, 1e3), "winch_speed_1 to winch_speed_3 are in mm/s"),
    "speeds in m/min": (scaled(SPEEDS, 60.0), "winch_speed_1 to winch_speed_3 are in m/min"),
    "speeds of a drum's angle": (scaled(SPEEDS, 20.0), "drums with a radius of 0.04999 m if in rad/s"),
    "all speeds of the other sign": (scaled(SPEEDS, -1.0), "winch_speed_1 to winch_speed_3 have the other sign"),
    "one speed of the other sign": (scaled(["winch_speed_3"], -1.0), "winch_speed_3 has the other sign"),
    "winches in another order": (reordered(SPEEDS, [1, 2, 0]), "winches of cables 1 to 3 are winch_speed_3"),
    "positions in mm": (scaled(AXES, 1e3), "x, y, z are in mm"),
    "positions in mm that are said to be in cm": (stated(AXES, 1e3, "cm"), "x, y, z are in mm, not in cm"),
    "an encoder that dies": (
        of_one_cable("winch_speed_2", lambda speed: speed.where(speed.index < 300, 0.0)),
        "winch_speed_2 stays at 0 from ",
    ),
    "a speed that is another's": (
        lambda f: text_of(f.assign(winch_speed_2=f.winch_speed_1)),
        "winch_speed_2 repeats winch_speed_1",
    ),
    "axes in another order": (reordered(AXES, [2, 0, 1]), "x, y, z are the recording's y, z, x"),
    "another origin": (
        lambda f: text_of(f.assign(**{a: f[a] - f[a][0] for a in AXES})),
        "x, y, z have another origin, about [29",
    ),
    "time in days, as spreadsheets have it": (scaled(["time"], 1.0 / 86_400.0), "time is in d"),
    "speeds of a drum in revolutions per minute": (scaled(SPEEDS, 191.0), "drums with a radius of 0.005"),
    "speeds of a drum in turns": (scaled(SPEEDS, 3.183), "0.04999 m if in turns/s"),
    "speeds of a motor before its gear": (scaled(SPEEDS, 2387.0), "1 of theirs is 0.000418"),
    "speeds in counts": (scaled(SPEEDS, 13_038.0), "m/s, as of an encoder's counts"),
    "rope lengths in counts": (as_lengths(1.63e5), " m, as of an encoder's counts"),
    "rope lengths in feet": (as_lengths(3.28084), "rope_length_1 to rope_length_3 are in ft"),
    "angles of drums in degrees": (as_lengths(1146.0), "0.04999 m if in deg"),
    "positions in inches": (scaled(AXES, 39.37008), "x, y, z are in in"),
    "positions in feet": (scaled(AXES, 3.28084), "x, y, z are in ft"),
    "positions in um": (scaled(AXES, 1e6), "x, y, z are in um"),
    "one coordinate in mm": (scaled(["z"], 1e3), "z is in mm"),
    "z downwards": (lambda f: text_of(f.assign(z=-f.z)), "x, y, z are the recording's x, y, -z"),
    "y upwards": (lambda f: text_of(f.assign(y=f.z, z=-f.y)), "x, y, z are the recording's x, -z, y"),
    "left-handed axes": (lambda f: text_of(f.assign(y=f.z, z=f.y)), "x, y, z are the recording's x, z, y"),
    "a tracker's frame that is turned": (turned, "x, y, z are in a frame that is turned by about "),
    "a tracker's frame in mm, z downwards": (
        lambda f: text_of(f.assign(x=1e3 * (f.x + 30.0), y=-1e3 * f.y, z=-1e3 * (f.z - 2.0))),
        "x, y, z are in mm and the robot file's x, y, z are the recording's x, -y, -z and x, y, z have another origin",
    ),
    "clocks apart": (tracker_late, "the winches' clock is 0."),
    "tensions in kN": (scaled(CELLS, 1e-3), "tension_1 to tension_3 are in kN"),
    "tensions in kg": (scaled(CELLS, 1.0 / 9.80665), "tension_1 to tension_3 are in kg"),
    "tensions in g": (scaled(CELLS, 1e3 / 9.80665), "tension_1 to tension_3 are in g"),
    "tensions of the other sign": (scaled(CELLS, -1.0), "tension_1 to tension_3 have the other sign"),
    "tensions in daN": (scaled(CELLS, 0.1), "tension_1 to tension_3 are in daN"),
    "tensions in counts of a converter": (scaled(CELLS, 6.5536), "1 of tension_1 to tension_3 is about 0.153 N"),
    "tensions in mV/V": (scaled(CELLS, 4e-4), "1 of tension_1 to tension_3 is about 2.5"),
    "one tension in kN": (scaled(CELLS[1:2], 1e-3), "tension_2 alone is in kN"),
    "one tension of the other sign": (scaled(CELLS[1:2], -1.0), "tension_2 alone has the other sign"),
    "load cells tared under load": (tared, "were tared at the start, where statics gives 159"),
    "one load cell tared under load": (
        of_one_cable("tension_2", lambda cell: cell - cell[:10].mean()),
        "if tension_2 was tared at the start, where statics gives 159",
    ),
    "load cells swapped": (reordered(CELLS, [1, 0, 2]), "are tension_2, tension_1, tension_3"),
    "commas for separators and decimals": (lambda f: text_of(f, ",", ",").replace('"', ""), "cells, the header has"),
    "no header": (lambda frame: text_of(frame, header=False), "the header is missing"),
    "a unit that nobody knows": (stated(AXES, 1.0, "furlong"), "'[furlong]', not a known unit of length"),
    "units of some columns": (
        with_lines(lambda lines: [lines[0], "# s, m/s, m/s, m/s, N, N, N, mm, mm", *lines[1:]]),
        "line 2: has 9 units, the header has 10 columns",
    ),
    "words in the first sample": (
        with_lines(lambda lines: [lines[0], ",".join(["init"] * 10), *lines[1:]]),
        "is 'init', not a number",
    ),
    "a first sample without numbers": (
        with_lines(lambda lines: [lines[0], ",".join(["null"] * 10), *lines[1:]]),
        "column time: is 'null', must be a number",
    ),
    "times since 1970 in ns": (
        lambda f: text_of(f.assign(time=[1_780_000_000 * 10**9 + round(1e9 * t) for t in f.time])),
        "as ns since 1970 are (and 799 more like it, last in line 801); write time [ns] in the header",
    ),
    "times since 1970 in us": (
        lambda f: text_of(f.assign(time=[1_780_000_000 * 10**6 + round(1e6 * t) for t in f.time])),
        "as us since 1970 are",
    ),
    "times with too few digits": (
        lambda f: text_of(f.assign(time=f.time.round(1))),
        "of times that are rounded write more digits",
    ),
    "a clock that was set back": (
        lambda f: text_of(f.assign(time=f.time.where(f.index < 500, f.time - 1.005))),
        "where the clock was set or a second run begins, cut the recording there",
    ),
    "two runs, each with its header": (
        with_lines(lambda lines: lines[:400] + lines[:300]),
        "repeats the names of the columns; cut the file there",
    ),
    "thousands with commas": (
        lambda f: text_of(f.assign(tension_1=[f"{10.0 * value:,.3f}" for value in f.tension_1])),
        "write it with a decimal point, without separators of thousands",
    ),
    "thousands with points": (
        lambda f: text_of(
            f.assign(tension_1=[f"{10.0 * v:,.3f}".translate(str.maketrans(",.", ".,")) for v in f.tension_1]), ";", ","
        ),
        "write it with a decimal comma, without separators of thousands",
    ),
    "numbers of Fortran": (
        lambda f: text_of(f.assign(x=[f"{value:.9E}".replace("E", "D") for value in f.x])),
        "E+01",
    ),
    "a minus of typesetters": (
        lambda f: text_of(f.assign(y=[f"{value:.6f}".replace("-", "\u2212") for value in f.y])),
        "write it as -0.",
    ),
    "units in cells": (
        lambda f: text_of(f.assign(z=[f"{value:.6f} m" for value in f.z])),
        ", and the unit in the header",
    ),
    "an angle's unit": (
        stated(SPEEDS, 191.0, "rpm"),
        "leave the unit out, and declare factor = 2 pi / 60 times the drum's radius",
    ),
    "an amplifier's unit": (stated(CELLS, 4e-4, "mV/V"), "declare factor = the load cell's N for one"),
    "infinite numbers": (lambda f: text_of(f.assign(y=f.y.where(f.index < 790, np.inf)).fillna("")), "must be finite"),
    "cables from 0": (
        lambda f: text_of(f.rename(columns={name: f"{name[:-1]}{int(name[-1]) - 1}" for name in (*SPEEDS, *CELLS)})),
        "count cables from 1",
    ),
    "German names": (
        lambda f: text_of(
            f.set_axis(["Zeit [s]", *(f"Position {k} [m]" for k in range(1, 7)), "x", "y", "z"], axis=1), ";", ","
        ),
        "has none of the columns time, winch_speed_1 ... winch_speed_3, it has 'Zeit [s], Position 1 [m]",
    ),
    "a page of HTML": (lambda f: f"<html>{f[:5].to_html()}</html>", "is HTML or XML, not a table in CSV"),
    "a list in JSON": (lambda f: str(f[:5].to_json(orient="records")), "is JSON, not a table in CSV"),
    "a last line that is cut": (lambda f: text_of(f)[:-30], "cells, the header has 10; complete the line or remove it"),
    "a log with room for more": (
        lambda f: text_of(f).encode() + bytes(500),
        "is binary (it has a zero byte), not text",
    ),
    "a word below the samples": (lambda f: text_of(f) + "End\n", "line 802: has 1 cell, the header has 10"),
    "sums below the samples": (lambda f: text_of(f) + "Mean" + ",0" * 9 + "\n", "column time: is 'Mean', not a number"),
    "a winch without speed": (lambda f: text_of(f.rename(columns={"winch_speed_2": "v2"})), "winch_speed_2 is missing"),
    "a second column of a name": (lambda f: text_of(f.rename(columns={"y": "x"})), "'x' appears twice"),
    "a fourth cable": (lambda f: text_of(f.assign(tension_4=1.0)), "tension_4 belongs to no cable"),
    "samples in reverse": (lambda frame: text_of(frame[::-1]), "must rise from sample to sample"),
    "samples twice": (lambda frame: text_of(pd.concat((frame, frame))), "must rise from sample to sample"),
    "words in cells": (lambda frame: text_of(frame.assign(tension_2="OVERLOAD")), "and 799 more like it"),
    "a speed that is missing for long": (empty_speeds(40), "winch_speed_2: is empty, must be a number"),
    "one sample": (lambda frame: text_of(frame.iloc[:1]), "has 1 sample, must have at least 2"),
    "nothing": (lambda frame: "", "is empty"),
    "a workbook": (lambda frame: b"PK\x03\x04" + bytes(100), "a zip archive or a spreadsheet, not text"),
    "positions in mm beside a gap": (
        lambda f: text_of(f.assign(**{axis: 1e3 * f[axis] for axis in AXES}).drop(index=range(150, 300))),
        "x, y, z are in mm",
    ),
    "names in capitals, with a unit": (
        lambda f: text_of(
            f.assign(**{a: 1e3 * f[a] for a in AXES}).rename(columns={a: f"{a.upper()} [mm]" for a in AXES})
        ),
        'write into [recording.columns] x = { name = "X [mm]", unit = "mm" }',
    ),
    "a unit at the end of a name": (
        lambda f: text_of(f.assign(**{c: 1e-3 * f[c] for c in CELLS}).rename(columns={c: f"{c}_kN" for c in CELLS})),
        "the column 'tension_2_kN' is not read, and tension_2 is missing",
    ),
    "the largest number where nothing was measured": (
        lambda f: text_of(f.assign(z=f.z.where(f.index % 50 > 0, 1.7e308))),
        "or leave the cell of an output empty where nothing was measured",
    ),
    "times of a controller": (
        lambda f: text_of(f.assign(time=[f"T#{round(1e3 * t)}ms" for t in f.time])),
        "write seconds, hh:mm:ss, or ISO 8601",
    ),
    "load cells in kN that were tared under load": (
        lambda f: text_of(f.assign(**{cell: 1e-3 * (f[cell] - f[cell][:10].mean()) for cell in CELLS})),
        "N, and are in kN",
    ),
    "load cells in kg, one of the other sign": (
        lambda f: text_of(f.assign(**{c: f[c] / (-9.80665 if c == CELLS[0] else 9.80665) for c in CELLS})),
        "tension_1 is too, and has the other sign",
    ),
    "one load cell in volts": (scaled(CELLS[2:], 0.0123), "1 of tension_3 alone is about 81.3 N"),
    "one drum in rpm": (
        scaled(SPEEDS[:1], 95.5),
        "winch_speed_1 is no speed of a rope in m/s: 1 of it is 0.0105 m/s, ",
    ),
    "one speed in half, of the other sign": (scaled(SPEEDS[:1], -2.0), "and winch_speed_1 has the other sign"),
    "an old spreadsheet": (lambda frame: b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(500), "an old spreadsheet (.xls)"),
    "an array of NumPy": (lambda frame: b"\x93NUMPY" + bytes(500), "load it with numpy.load"),
    "a TDMS file": (lambda frame: b"TDSm" + bytes(500), "a TDMS file of LabVIEW"),
    "HDF5 that is no MATLAB file": (lambda frame: b"\x89HDF\r\n\x1a\n" + bytes(500), "is HDF5"),
    "the time of LabVIEW": (
        lambda f: labview(f.rename(columns={"time": "X_Value"})),
        'write into [recording.columns] time = { name = "X_Value" }',
    ),
    "a column of each line": (lambda f: f[:99].T.to_csv(header=False), "is transposed: lines begin with time, winch"),
    "a name in each cell": (
        with_lines(
            lambda lines: [
                "\t".join(f"{name}:{cell}" for name, cell in zip(lines[0].split(","), line.split(","), strict=True))
                for line in lines[1:-1]
            ]
        ),
        "has a name in each cell, as in 'time:0.0'",
    ),
    "a serial monitor's log": (
        with_lines(lambda lines: [f"10:00:{i % 60:02d}.123 -> {line}" for i, line in enumerate(lines[1:-1])]),
        "begins with a time and an arrow",
    ),
    "a counter of 16 bits for times": (
        lambda f: text_of(f.assign(time=[(65_000 + round(1e3 * t)) % 2**16 for t in f.time])),
        "as a counter of 16 bits does where it begins anew (and 130 more like it, last in line 186); add 65536",
    ),
    "names of ROS behind a mark": (
        lambda f: text_of(f.set_axis(["%time", *(f"field.v{k}.data" for k in range(len(f.columns) - 1))], axis=1)),
        "line 1: has none of the columns winch_speed_1 ... winch_speed_3, it has 'field.v0.data",
    ),
    "accelerations for speeds": (
        lambda f: text_of(f.assign(**{name: np.gradient(f[name], f.time) for name in SPEEDS})),
        "more than winches that stand would be",
    ),
    "one speed in half": (scaled(SPEEDS[1:2], 0.5), "gears, drums or intervals of time 2 times those"),
    "one speed twice as large": (scaled(SPEEDS[1:2], 2.0), "gears, drums or intervals of time 0.5 times those"),
    "speeds that were never logged": (scaled(SPEEDS, 0.0), "the columns of the winches are not of this motion"),
    "another robot": (
        lambda frame: text_of(pd.read_csv(EXAMPLES / "caroca" / "fit.csv", nrows=ROWS)),
        "does not match the positions",
    ),
}

ROBOTS: dict[str, tuple[str, str, str]] = {
    "modulus in GPa": ("modulus = 1.022e11", "modulus = 102.2", "in GPa as 1.022e+11"),
    "modulus in MPa": ("modulus = 1.022e11", "modulus = 102200.0", "in MPa as 1.022e+11"),
    "area in mm^2": ("area = 1.25664e-5", "area = 12.5664", "in mm^2 as 1.25664e-05"),
    "damping of a whole rope": ("damping = 4.0e8", "damping = 4.0e12", "write it in Pa s"),
    "gravity in mm/s^2": ("gravity = 9.81", "gravity = 9810.0", "if this is in mm/s^2 as 9.81"),
    "gravity in g": ("gravity = 9.81", "gravity = 1", "if this is in g as 9.80665"),
    "mass in lb": ("mass = 300.0", "mass = 661.4", "platform.mass is in lb"),
    "anchors in mm": ("50.0, 50.0]", "50000.0, 50000.0]", "in mm multiply by 0.001"),
    "stiffer ropes": ("modulus = 1.022e11", "modulus = 1.022e12", "write it in Pa, 1.02e+11 fits"),
    "softer ropes": ("modulus = 1.022e11", "modulus = 1.022e10", "write it in Pa, 1.02e+11 fits"),
    "an exit point without its last digit": (
        "[0.0, -50.0, 50.0]",
        "[0.0, -50.0, 5.0]",
        "winch travel of cable 2 does not match the positions",
    ),
    "a noise in mm": ("position_noise = 3e-4", "position_noise = 0.3", "if this is in mm as 0.0003"),
    "a noise in kN": ("tension_noise = 2.0", "tension_noise = 0.002", "if this is in kN as 2"),
    "a drum in mm": (
        "[sensors]",
        "[winch]\ndrum_radius = 50\ngear = 10\nbandwidth = 20\n[sensors]",
        "if this is in mm as 0.05",
    ),
}


@pytest.mark.validate(only=["comma", "over", "say so"])
@pytest.mark.parametrize("file", READ)
def test_it_is_read_right(file: str, tmp_path: Path) -> None:
    laboratory, frame = Laboratory(tmp_path), standard()
    assert laboratory.problems(READ[file](frame)) == []
    recording = read_recording(tmp_path / "log.csv", 3)
    expected = frame.to_numpy(dtype=float)
    shown = np.column_stack((recording.time, recording.winch_speed, recording.tension, recording.position))
    assert shown.shape == expected.shape
    assert np.allclose(shown[:, 0] - shown[0, 0], expected[:, 0] - expected[0, 0], rtol=0.0, atol=1e-9)
    assert np.allclose(shown[:, 1:], expected[:, 1:], rtol=1e-12, atol=1e-15)


def test_one_speed_that_is_missing_is_interpolated_and_told(tmp_path: Path) -> None:
    laboratory, frame = Laboratory(tmp_path), standard()
    checked = check_files(laboratory.robot(ROBOT), laboratory.recording(empty_speeds(1)(frame)))
    assert checked.problems == () and any("winch_speed_2" in note for note in checked.notes)
    recording = read_recording(tmp_path / "log.csv", 3)
    neighbours = frame["winch_speed_2"][[99, 101]].mean()
    assert recording.winch_speed[100, 1] == pytest.approx(neighbours, rel=1e-12)


MISSING = ("NULL", "#N/A", "n/a", "-", "-nan(ind)", "1.#QNAN", "NaN ", "---", "#NV", "#DIV/0!", "1.#QNAN0")


@pytest.mark.parametrize("word", MISSING)
def test_what_programs_write_for_a_missing_number_is_one(word: str, tmp_path: Path) -> None:
    laboratory, frame = Laboratory(tmp_path), standard().astype(object)
    frame.loc[200:229, AXES] = word
    assert laboratory.problems(text_of(frame)) == []
    position = read_recording(tmp_path / "log.csv", 3).position
    assert np.array_equal(np.flatnonzero(np.isnan(position).all(axis=1)), np.arange(200, 230))


@pytest.mark.parametrize("value", [0.0, -9999.0])
def test_placeholders_of_a_tracker_are_left_out_and_told(value: float, tmp_path: Path) -> None:
    laboratory, frame = Laboratory(tmp_path), standard()
    checked = check_files(laboratory.robot(ROBOT), laboratory.recording(lost_positions(value)(frame)))
    assert checked.problems == () and any("60 samples at" in note for note in checked.notes)
    position = read_recording(tmp_path / "log.csv", 3).position
    is_lost = frame.index % 400 >= 370
    assert np.isnan(position[is_lost]).all() and position[~is_lost] == pytest.approx(frame[AXES].to_numpy()[~is_lost])


def test_an_encoder_whose_range_ends_is_read_on_and_told(tmp_path: Path) -> None:
    laboratory, frame = Laboratory(tmp_path), standard()
    counts = pd.read_csv(io.StringIO(str(as_lengths(1.63e5)(frame))))
    for cable in (1, 2, 3):
        recorded = np.round(counts[f"rope_length_{cable}"] + 32_000.0).astype(int)
        counts[f"rope_length_{cable}"] = (recorded + 2**15) % 2**16 - 2**15
    columns = '\n[recording.columns]\n"rope_length_{}" = { name = "rope_length_{}", factor = 6.13497e-6 }\n'
    checked = check_files(laboratory.robot(ROBOT + columns), laboratory.recording(text_of(counts)))
    assert checked.problems == () and any("begins anew after 65536" in note for note in checked.notes)
    assert checked.recording is not None
    speed, expected = checked.recording.winch_speed, frame[SPEEDS].to_numpy()
    assert np.sqrt(np.mean((speed - expected) ** 2)) < 0.02 * np.sqrt(np.mean(expected**2))


def test_the_motion_of_winches_in_a_gap_is_not_held_against_positions(tmp_path: Path) -> None:
    laboratory, frame = Laboratory(tmp_path), standard().drop(index=range(150, 450))
    checked = check_files(laboratory.robot(ROBOT), laboratory.recording(text_of(frame)))
    assert checked.problems == () and any("the winch motion in its gaps" in note for note in checked.notes)
    assert not any("winch travel is off the recorded positions" in note for note in checked.notes)


@pytest.mark.parametrize("column", ["z", "tension_2", "winch_speed_3"])
def test_a_code_of_a_missing_number_is_left_out_and_told(column: str, tmp_path: Path) -> None:
    laboratory, frame = Laboratory(tmp_path), standard()
    coded = frame.assign(**{column: frame[column].where(frame.index % 300 != 200, -9999.0)})
    checked = check_files(laboratory.robot(ROBOT), laboratory.recording(text_of(coded)))
    assert checked.problems == ()
    assert any(f"{column}: 2 samples at -9999, as programs write" in note for note in checked.notes)
    assert not any("outliers" in note for note in checked.notes)


def test_positions_of_too_few_digits_are_told_with_the_noise_that_they_have(tmp_path: Path) -> None:
    laboratory, frame = Laboratory(tmp_path), standard()
    rounded = frame.assign(**{axis: frame[axis].round(2) for axis in AXES})
    checked = check_files(laboratory.robot(ROBOT), laboratory.recording(text_of(rounded)))
    assert checked.problems == ()
    assert any("values are in steps of 0.01 m" in note and "0.00289 m is used" in note for note in checked.notes)


@pytest.mark.parametrize("factor", [0.5, 1.5])
def test_anchors_of_another_scale_are_refused_with_it(factor: float, tmp_path: Path) -> None:
    laboratory = Laboratory(tmp_path)
    numbers = {"50.0": f"{50.0 * factor}", "86.6": f"{86.6 * factor}"}
    lines = [
        re.sub(r"50\.0|86\.6", lambda match: numbers[match.group()], line) if line.startswith("anchor") else line
        for line in ROBOT.splitlines()
    ]
    checked = check_files(laboratory.robot("\n".join(lines)), laboratory.recording(text_of(standard())))
    (problem,) = map(str, checked.problems)
    assert f"if all anchors in the robot file are {factor:.3g} times the true ones" in problem.replace("0.501", "0.5")


@pytest.mark.parametrize("file", ["names in capitals, with a unit", "a unit at the end of a name"])
def test_the_line_that_is_told_for_a_name_reads_it(file: str, tmp_path: Path) -> None:
    laboratory, frame = Laboratory(tmp_path), standard()
    hints = laboratory.problems(str(REFUSED[file][0](frame)))
    lines = [hint.partition("[recording.columns] ")[2].partition(", or rename")[0] for hint in hints]
    robot = laboratory.robot("\n".join([ROBOT, "[recording.columns]", *lines, ""]))
    checked = check_files(robot, tmp_path / "log.csv")
    assert checked.problems == () and checked.recording is not None
    assert checked.recording.position == pytest.approx(frame[AXES].to_numpy(), rel=1e-12)
    assert checked.recording.tension == pytest.approx(frame[CELLS].to_numpy(), rel=1e-12)


# What is searched for among readings of the motion takes seconds; tests/recordings/test_mistaken_motion.py has a case
# of each in make test.
MISREAD_MOTION = (
    *("speed", "position", "drum", "time in", "length", "commas for", "header", "axes", "frame", "clocks"),
    *("coordinate", "encoder", "robot", "origin", "winches", "row numbers", "times of"),
)


@pytest.mark.validate(only=MISREAD_MOTION)
@pytest.mark.parametrize("file", REFUSED)
def test_it_is_refused_with_its_cause(file: str, tmp_path: Path) -> None:
    write, cause = REFUSED[file]
    problems = Laboratory(tmp_path).problems(write(standard()))
    assert any(cause in problem for problem in problems), problems
    assert len(problems) <= 10


@pytest.mark.parametrize("change", ROBOTS)
def test_a_robot_file_in_other_units_is_refused_with_the_unit(change: str, tmp_path: Path) -> None:
    before, after, cause = ROBOTS[change]
    assert before in ROBOT
    laboratory = Laboratory(tmp_path)
    checked = check_files(laboratory.robot(ROBOT.replace(before, after)), laboratory.recording(text_of(standard())))
    assert any(cause in str(problem) for problem in checked.problems), checked.problems
