"""Names that a line repeats are made unique by the lines above, or by the number of the column."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tautwire.errors import RecordingError
from tautwire.recordings.column_names import csv_layout
from tautwire.recordings.csv_names import first_samples, names_above
from tautwire.recordings.recording import read_tracker
from tautwire.robot.schema import RecordedColumn

MOTIVE = (
    "Format Version,1.23,Take Name,Take 1\n\n"
    ",,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body\n"
    ",,Hook,Hook,Hook,RB1,RB1,RB1\n"
    ",,F1A,F1A,F1A,F2B,F2B,F2B\n"
    ",,Rotation,Position,Mean Marker Error,Rotation,Position,Mean Marker Error\n"
    "Frame,Time (Seconds),X,X,,X,X,\n"
)
MOTIVE_NAMES = """
    Frame;Time (Seconds);Hook_Rotation_X;Hook_Position_X;Hook_Mean Marker Error;RB1_Rotation_X;RB1_Position_X;
    RB1_Mean Marker Error
"""
VICON = "Trajectories\n120\n,,Body:RB1,,,Body:RB2,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n,,mm,mm,mm,mm,mm,mm\n"
VICON_NAMES = "Frame;Sub Frame;Body:RB1_X;Body:RB1_Y;Body:RB1_Z;Body:RB2_X;Body:RB2_Y;Body:RB2_Z"
ROW = "1,0,3,4,5,6,7,8\n2,0,3,4,5,6,7,9\n"

HEADS = {
    "each once": ("Zeit,a,b,c,d,e,f,g\n", "Zeit;a;b;c;d;e;f;g"),
    "the first that names each once": ("Zeit,a,b,c,d,e,f,g\nt,x,x,x,x,x,x,x\n", "Zeit;a;b;c;d;e;f;g"),
    "Motive": (MOTIVE, MOTIVE_NAMES),
    "Vicon": (VICON, VICON_NAMES),
    "Vicon without commas at the end": (VICON.replace("RB2,,", "RB2"), VICON_NAMES),
    "comments": ("# ,,A,,,B,,\n# t,i,X,Y,Z,X,Y,Z\n", "t;i;A_X;A_Y;A_Z;B_X;B_Y;B_Z"),
    "no line above": ("t,i,X,Y,Z,X,Y,Z\n", "t;i;X_3;Y_4;Z_5;X_6;Y_7;Z_8"),
    "text above": ("Take 1,of,May\nt,i,X,Y,Z,X,Y,Z\n", "t;i;X_3;Y_4;Z_5;X_6;Y_7;Z_8"),
    "lines above that tell some apart": (",,A,A,A,A,B,B\nt,i,X,Y,X,Y,X,Y\n", "t;i;A_X_3;A_Y_4;A_X_5;A_Y_6;B_X;B_Y"),
    "a standard name": ("time,x,x,y,y,z,z,a\n", "time;x;x;y;y;z;z;a"),
}


@pytest.mark.parametrize("case", HEADS)
def test_each_column_has_a_name_of_its_own(case: str) -> None:
    head, expected = HEADS[case]
    lines = (head + ROW).splitlines()
    named = names_above(lines, next(first_samples(lines)))
    assert named is not None and list(named.names) == [name.strip() for name in expected.split(";")]


@pytest.mark.parametrize("head", ["time,x,x,y,y,z,z,a\n", "t,i,X,X,X_4,Y,Z,W\n"])
def test_names_that_stay_alike_are_refused(head: str, tmp_path: Path) -> None:
    (tmp_path / "tracker.csv").write_text(head + ROW, encoding="utf-8")
    with pytest.raises(RecordingError, match=r"line 1: the column '[xX]' appears 2 times"):
        csv_layout(tmp_path / "tracker.csv")


def declared(time: str, x: str, unit: str) -> list[RecordedColumn]:
    # Frames have no unit, and the laboratory's factor tells how long one is.
    factor = 0.01 if time == "Frame" else 1.0
    return [RecordedColumn("time", time, factor=factor), RecordedColumn("x", x, unit=unit)]


@pytest.mark.parametrize(
    ("head", "columns", "expected"),
    [
        (MOTIVE, declared("Frame", "RB1_Position_X", "mm"), 7e-3),
        (VICON, declared("Frame", "Body:RB2_X", "mm"), 6e-3),
        ("t,i,X,Y,Z,X,Y,Z\n", declared("t", "X_6", ""), 6.0),
        ("# t,i,X,Y,Z,X,Y,Z\n# s,s,mm,mm,mm,mm,mm,mm\n", declared("t", "X_6", ""), 6e-3),
        ("time,x,y,z,aux,aux,aux,b\n", [], 0.0),
    ],
    ids=["Motive", "Vicon", "no line above", "comments", "names that are not read"],
)
def test_a_recording_is_read_by_the_names_that_are_proposed(
    head: str, columns: list[RecordedColumn], expected: float, tmp_path: Path
) -> None:
    (tmp_path / "tracker.csv").write_text(head + ROW, encoding="utf-8")
    names = csv_layout(tmp_path / "tracker.csv").names
    assert {each.name for each in columns} <= set(names)
    recording = read_tracker(tmp_path / "tracker.csv", columns)
    np.testing.assert_allclose(recording.position[:, 0], expected, rtol=1e-12)
    assert recording.time[1] == 2.0 * recording.time[0]


def test_a_name_that_repeats_is_answered_with_those_that_are_made_of_it(tmp_path: Path) -> None:
    (tmp_path / "tracker.csv").write_text(VICON + ROW, encoding="utf-8")
    with pytest.raises(RecordingError, match=r"line 4: has no column 'X'.*Body:RB1_X"):
        read_tracker(tmp_path / "tracker.csv", declared("Frame", "X", "mm"))


@pytest.mark.parametrize(
    ("lines", "names"),
    [
        (["Time [s];Speed1;Speed2;State", "0,00;0,1;0,1;RUN", "0,01;0,1;0,1;RUN"], "Time [s] Speed1 Speed2 State"),
        (["Date;Time;Speed1", "31.05.2024;12:00:00,00;0,1", "31.05.2024;12:00:00,01;0,1"], "Date Time Speed1"),
        (["time,speed,on", "0,1,TRUE", "1,2,FALSE"], "time speed on"),
    ],
)
def test_samples_beside_a_text_are_samples(lines: list[str], names: str) -> None:
    samples = list(first_samples(lines))
    assert [sample.index for sample in samples] == [1]
    named = names_above(lines, samples[0])
    assert named is not None and " ".join(named.names) == names


def test_texts_beside_numbers_that_do_not_repeat_are_no_samples() -> None:
    assert not list(first_samples(["version,1,2,beta", "name,hall,3", "mass,12,kg,4"]))
