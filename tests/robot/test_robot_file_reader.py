"""Robot files: what is read, what is refused and with which words."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tautwire.errors import InputError, RobotFileError
from tautwire.robot.robot_file_reader import read_robot, read_robot_with_sink
from tautwire.robot.schema import Cable, EffectSetting, Platform, Robot, Sensors, TensionLimits, UserFmu, Winch

HALL = """\
name = "hall"
gravity = 9.81

[platform]
mass = 80.0
start = [10.0, 5.5, 4.0]

[tension]
minimum = 50.0
maximum = 10000
preferred = 500.0

[sensors]
position_noise = 1.5e-4

[[cable]]
anchor = [0.0, 0.0, 12.0]
modulus = 6.0e10
area = 3.2e-6
damping = 4.0e8
law = "logarithmic"

[[cable]]
anchor = [20, 0, 12]
modulus = 61000000000
area = 3.2e-6
law = "linear"

[[cable]]
anchor = [10.0, 16.0, 12.0]
modulus = 6.2e10
area = 3.2e-6
damping = 0
law = "logarithmic"
"""


def refused(folder: Path, text: str | bytes) -> RobotFileError:
    """The error about a robot file, after checking what every such error has."""
    path = folder / "robot.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(RobotFileError) as caught:
        read_robot(path)
    error = caught.value
    assert error.where.startswith(str(path))
    assert error.problem and error.hint
    assert len(str(error).splitlines()) == 1
    return error


def key_of(error: RobotFileError) -> str:
    """The key or line that an error names."""
    return error.where.partition("robot.toml: ")[2]


def read(folder: Path, text: str | bytes) -> Robot:
    """The robot in a text."""
    path = folder / "robot.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_robot(path)


def test_reads_every_declared_value(tmp_path: Path) -> None:
    assert read(tmp_path, HALL) == Robot(
        name="hall",
        gravity=9.81,
        platform=Platform(80.0, (10.0, 5.5, 4.0)),
        tension=TensionLimits(50.0, 10000.0, 500.0),
        sensors=Sensors(position_noise=1.5e-4),
        cables=(
            Cable((0.0, 0.0, 12.0), 6.0e10, 3.2e-6, 4.0e8, "logarithmic"),
            Cable((20.0, 0.0, 12.0), 6.1e10, 3.2e-6, 0.0, "linear"),
            Cable((10.0, 16.0, 12.0), 6.2e10, 3.2e-6, 0.0, "logarithmic"),
        ),
    )


def test_whole_numbers_become_floats(tmp_path: Path) -> None:
    robot = read(tmp_path, HALL)
    assert type(robot.cables[1].modulus) is float
    assert type(robot.cables[1].anchor[0]) is float


def test_name_and_gravity_have_defaults(tmp_path: Path) -> None:
    robot = read(tmp_path, HALL.partition("\n\n")[2])
    assert (robot.name, robot.gravity) == ("robot", 9.81)


def test_accepts_a_byte_order_mark_and_windows_line_ends(tmp_path: Path) -> None:
    windows = b"\xef\xbb\xbf" + HALL.replace("\n", "\r\n").encode()
    assert read(tmp_path, windows) == read(tmp_path, HALL)


def test_effect_without_cables_holds_for_all(tmp_path: Path) -> None:
    robot = read(tmp_path, HALL + "\n[effect.damping]\ndamping = 2.1e9\n")
    assert robot.effects == (EffectSetting("damping", {"damping": 2.1e9}, (1, 2, 3)),)


def test_effect_may_hold_with_other_numbers_for_other_cables(tmp_path: Path) -> None:
    one = "[[effect.modulus]]\nmodulus = 5e10\ncables = [3, 1]\n"
    other = "[[effect.modulus]]\nmodulus = 7e10\ncables = [2]\n"
    robot = read(tmp_path, HALL + one + other + "[effect.payload]\nmass = -3\n")
    assert robot.effects == (
        EffectSetting("modulus", {"modulus": 5e10}, (1, 3)),
        EffectSetting("modulus", {"modulus": 7e10}, (2,)),
        EffectSetting("payload", {"mass": -3.0, "x": 0.0, "y": 0.0, "z": 0.0}),
    )
    assert [setting.values["modulus"] for setting in robot.effects_on_cable(2)] == [7e10]
    assert robot.effects_elsewhere() == robot.effects[2:]


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ("mass = 80.0", "", "platform.mass", ["missing", "kg"]),
        ("mass = 80.0", "mass = 0", "platform.mass", ["0.0", "above 0 kg"]),
        ("mass = 80.0", "mass = -2.5", "platform.mass", ["-2.5", "above 0 kg"]),
        ("mass = 80.0", "mass = true", "platform.mass", ["true", "not a number"]),
        ("mass = 80.0", 'mass = "80"', "platform.mass", ["'80'", "not a number"]),
        ("mass = 80.0", "mass = nan", "platform.mass", ["nan", "finite"]),
        ("mass = 80.0", "mass = 1e400", "platform.mass", ["inf", "finite"]),
        ("mass = 80.0", "mass = 1e99", "platform.mass", ["1e+99", "at most 1e+15 kg"]),
        ("mass = 80.0", "mass = 2020-01-01", "platform.mass", ["2020-01-01", "not a number"]),
        ("mass = 80.0", "mass = 80.0\nmas = 1", "platform.mas", ["not a known key", "'mass'"]),
        ("start = [10.0, 5.5, 4.0]", "", "platform.start", ["missing"]),
        ("start = [10.0, 5.5, 4.0]", "start = [1.0, 2.0]", "platform.start", ["2 entries", "3"]),
        ("start = [10.0, 5.5, 4.0]", "start = [1.0, inf, 2.0]", "platform.start[2]", ["inf", "finite"]),
        ("start = [10.0, 5.5, 4.0]", "start = [1e16, 0, 0]", "platform.start[1]", ["1e+16", "1e+15"]),
        ("start = [10.0, 5.5, 4.0]", "start = 4.0", "platform.start", ["4.0", "not a list"]),
        ("start = [10.0, 5.5, 4.0]", "start = [20, 0, 12]", "cable[2].anchor", ["20.0", "platform.start"]),
        ("gravity = 9.81", "gravity = -9.81", "gravity", ["-9.81", "at least 0 m/s^2"]),
        ("gravity = 9.81", "gravityy = 9.81", "gravityy", ["'gravity'"]),
        ("gravity = 9.81", "platform = 3", "line 4", ["TOML"]),
        ("gravity = 9.81", "gravity = ", "line 2", ["TOML", "column"]),
        ('name = "hall"', "name = 3", "name", ["3", "not text"]),
        ('name = "hall"', 'name = " "', "name", ["printable"]),
        ('name = "hall"', 'name = "a\\nb"', "name", ["printable"]),
        ('name = "hall"', "[winches]\nradius = 0.1\n[x]", "winches", ["not a known key", "'winch'"]),
        ("minimum = 50.0", "minimum = -1", "tension.minimum", ["-1.0", "at least 0 N"]),
        ("minimum = 50.0", "minimum = 20000", "tension.minimum", ["20000.0", "10000.0"]),
        ("minimum = 50.0", "", "tension.minimum", ["missing"]),
        ("preferred = 500.0", "preferred = 10", "tension.preferred", ["10.0", "50.0", "10000.0"]),
        ("preferred = 500.0", "prefered = 500.0", "tension.prefered", ["'preferred'"]),
        ("maximum = 10000", "maximum = 0", "tension.maximum", ["above 0 N"]),
        ("position_noise = 1.5e-4", "position_noise = -1", "sensors.position_noise", ["at least 0 m"]),
        ("position_noise = 1.5e-4", "posit_noise = 1", "sensors.posit_noise", ["'position_noise'"]),
        ("modulus = 61000000000", "modulus = -61", "cable[2].modulus", ["-61.0", "above 0 Pa"]),
        ("modulus = 61000000000", "Modulus = 61", "cable[2].Modulus", ["not a known key", "'modulus'"]),
        ("modulus = 61000000000", "", "cable[2].modulus", ["missing", "Pa"]),
        ("anchor = [20, 0, 12]", "", "cable[2].anchor", ["missing"]),
        ("anchor = [20, 0, 12]", "anchor = [0, 0, 12]", "cable[2].anchor", ["cable 1"]),
        ("anchor = [20, 0, 12]", "anchor = [20, 0, 12, 1]", "cable[2].anchor", ["4 entries"]),
        ("anchor = [20, 0, 12]", 'anchor = [20, "a", 12]', "cable[2].anchor[2]", ["'a'", "not a number"]),
        ("area = 3.2e-6\nlaw", "area = 0.0\nlaw", "cable[2].area", ["0.0", "above 0 m^2"]),
        ("damping = 4.0e8", "damping = -1", "cable[1].damping", ["-1.0", "at least 0 Pa s"]),
        ('law = "linear"', 'law = "lineal"', "cable[2].law", ["'lineal'", "'linear'"]),
        ('law = "linear"', "law = 1", "cable[2].law", ["not text"]),
        ('law = "linear"', "", "cable[2].law", ["missing", "logarithmic"]),
    ],
)
def test_refuses_a_wrong_value(tmp_path: Path, old: str, new: str, key: str, words: list[str]) -> None:
    assert HALL.count(old) == 1
    error = refused(tmp_path, HALL.replace(old, new))
    assert key_of(error) == key
    assert not [word for word in words if word not in str(error)], str(error)


@pytest.mark.parametrize(
    ("effect", "key", "words"),
    [
        ("[effect.dampin]\ndamping = 1.0", "effect.dampin", ["not a known effect", "'damping'"]),
        ("[effect.damping]", "effect.damping.damping", ["missing", "Pa s"]),
        ("[effect.damping]\ndamping = -1.0", "effect.damping.damping", ["-1.0", "at least 0 Pa s"]),
        ("[effect.damping]\ndamping = 1e12", "effect.damping.damping", ["at most 1e+11 Pa s"]),
        ("[effect.damping]\ndampin = 1.0", "effect.damping.dampin", ["not a known key", "'damping'"]),
        ("[effect.damping]\ndamping = 1.0\ncables = [4]", "effect.damping.cables", ["4", "1 to 3"]),
        ("[effect.damping]\ndamping = 1.0\ncables = [0]", "effect.damping.cables", ["0", "1 to 3"]),
        ("[effect.damping]\ndamping = 1.0\ncables = [1.0]", "effect.damping.cables", ["1.0"]),
        ("[effect.damping]\ndamping = 1.0\ncables = [true]", "effect.damping.cables", ["true"]),
        ("[effect.damping]\ndamping = 1.0\ncables = [2, 2]", "effect.damping.cables", ["2 twice"]),
        ("[effect.damping]\ndamping = 1.0\ncables = []", "effect.damping.cables", ["empty"]),
        ("[effect.damping]\ndamping = 1.0\ncables = 2", "effect.damping.cables", ["not a list"]),
        ("[effect.payload]\nmass = 1.0\ncables = [1]", "effect.payload.cables", ["platform", "remove"]),
        ("[effect]\ndamping = 3", "effect.damping", ["3", "not a table"]),
        (
            "[[effect.damping]]\ndamping = 1.0\n[[effect.damping]]\ndamping = 2.0\ncables = [2]",
            "effect.damping[2].cables",
            ["twice for cable 2", "effect.damping[1]"],
        ),
        (
            "[[effect.payload]]\nmass = 1.0\n[[effect.payload]]\nmass = 2.0",
            "effect.payload[2]",
            ["twice", "effect.payload[1]"],
        ),
        ("[effect.payload]\nmass = -80.0", "effect", ["a mass of 0 kg", "remove less than its 80 kg"]),
        ("[formula]\nmass = '-90 + time'", "formula", ["a mass of -10 kg"]),
        (
            "[[effect.sensor_offset]]\nposition_offset_x = 0.01\ncables = [1]\n"
            "[[effect.sensor_offset]]\ntension_offset = 5.0\nposition_offset_z = 0.02\ncables = [2]",
            "effect.sensor_offset[2]",
            ["twice for the tracker", "effect.sensor_offset[1]"],
        ),
    ],
)
def test_refuses_a_wrong_effect(tmp_path: Path, effect: str, key: str, words: list[str]) -> None:
    error = refused(tmp_path, f"{HALL}\n{effect}\n")
    assert key_of(error) == key
    assert not [word for word in words if word not in str(error)], str(error)


def test_a_mass_that_is_no_number_is_one_error(tmp_path: Path) -> None:
    (tmp_path / "robot.toml").write_text(f'{HALL}\n[effect.payload]\nmass = "heavy"\n')
    errors: list[RobotFileError] = []
    read_robot_with_sink(tmp_path / "robot.toml", errors.append)
    assert [key_of(error) for error in errors] == ["effect.payload.mass"]


@pytest.mark.parametrize(
    ("text", "key", "words"),
    [
        ("[winch]", "winch.drum_radius", ["missing", "m"]),
        ("[winch]\nradius = 0.1", "winch.radius", ["not a known key", "'drum_radius'"]),
        ("[winch]\ndrum_radius = 0", "winch.drum_radius", ["0.0", "above 0 m"]),
        ("[winch]\ndrum_radius = 0.1\ngear = -3", "winch.gear", ["-3.0", "above 0"]),
        ("[winch]\ndrum_radius = 0.1\nbandwidth = 0", "winch.bandwidth", ["0.0", "at least 0.01 Hz"]),
        ("[winch]\ndrum_radius = 0.1\nbandwidth = 1e4", "winch.bandwidth", ["10000.0", "at most 1000 Hz"]),
        ("[winch]\ndrum_radius = 0.1\ndamping_ratio = 0", "winch.damping_ratio", ["0.0", "at least 0.05"]),
        ("[winch]\ndrum_radius = 0.1\nspeed_limit = -1", "winch.speed_limit", ["-1.0", "above 0 m/s"]),
        ("[winch]\ndrum_radius = 0.1\nacceleration_limit = 0", "winch.acceleration_limit", ["above 0 m/s^2"]),
        ("[[winch]]\ndrum_radius = 0.1", "winch", ["list", "not a table"]),
        ("[fmu]\nplatfrm = 'a.fmu'", "fmu.platfrm", ["not a known key", "'platform'"]),
        ("[fmu]\ncable_4 = 'a.fmu'", "fmu.cable_4", ["not a known key", "cable_1 ... cable_3"]),
        ("[fmu]\nplatform = 3", "fmu.platform", ["3", "not text", "mine.fmu"]),
        ("[fmu]\nplatform = ' '", "fmu.platform", ["path"]),
        ("[fmu]\nnative = 'yes'", "fmu.native", ["'yes'", "true or false"]),
        ('[fmu]\nplatform = "a\\u0000b"', "fmu.platform", ["path"]),
    ],
)
def test_refuses_a_wrong_winch_or_fmu(tmp_path: Path, text: str, key: str, words: list[str]) -> None:
    error = refused(tmp_path, f"{HALL}\n{text}\n")
    assert key_of(error) == key
    assert not [word for word in words if word not in str(error)], str(error)


def test_a_winch_has_defaults_and_limits_only_where_they_are_given(tmp_path: Path) -> None:
    assert read(tmp_path, HALL).winch is None
    assert read(tmp_path, f"{HALL}\n[winch]\ndrum_radius = 0.1\n").winch == Winch(0.1, 1.0, 10.0, 1.0, None, None)
    given = "drum_radius = 0.2\ngear = 30\nbandwidth = 25\ndamping_ratio = 0.7\nspeed_limit = 2\nacceleration_limit = 8"
    assert read(tmp_path, f"{HALL}\n[winch]\n{given}\n").winch == Winch(0.2, 30.0, 25.0, 0.7, 2.0, 8.0)


def test_fmus_of_the_users_are_found_from_the_robot_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    absolute = tmp_path.parent / "x.fmu"
    own = f"[fmu]\nplatform = 'models/mine.fmu'\ncable_2 = '../a.fmu'\nwinch_3 = '{absolute}'\n"
    path = tmp_path / "robot.toml"
    path.write_text(f"{HALL}\n{own}")
    monkeypatch.chdir(tmp_path)
    for place in (path, Path("robot.toml")):
        assert read_robot(place).fmus == (
            UserFmu("platform", tmp_path / "models" / "mine.fmu"),
            UserFmu("cable_2", tmp_path.parent / "a.fmu"),
            UserFmu("winch_3", absolute),
        )


@pytest.mark.parametrize(
    ("text", "key", "words"),
    [
        ("", "platform", ["missing", "[platform]"]),
        ("platform = 3", "platform", ["3", "not a table"]),
        (HALL.partition("[[cable]]")[0], "cable", ["0 given", "two"]),
        ("[[cable]]".join(HALL.split("[[cable]]")[:2]), "cable", ["1 given", "two"]),
        (HALL.partition("[[cable]]")[0] + "[cable]\nlaw = 1", "cable", ["array", "[[cable]]"]),
        ("cable = [1, 2, 3]\n" + HALL.partition("[[cable]]")[0], "cable[1]", ["1", "not a table"]),
        (HALL + "\n[platform]\n", "line 36", ["TOML"]),
        (HALL + "x", "line 35", ["TOML"]),
        (HALL + '\ny = "', "line 36", ["TOML"]),
        (HALL.encode() + b"# \xff", "line 35", ["0xff", "UTF-8"]),
        (HALL.encode() + b"# \0", "line 35", ["zero byte"]),
        (HALL.encode("utf-16"), "", ["UTF-16", "UTF-8"]),
        (b"PK\x03\x04" + bytes(100), "", ["zip"]),
    ],
)
def test_refuses_a_wrong_file(tmp_path: Path, text: str | bytes, key: str, words: list[str]) -> None:
    error = refused(tmp_path, text)
    assert not key or key_of(error) == key
    assert not [word for word in words if word not in str(error)], str(error)


def test_refuses_a_monstrous_file(tmp_path: Path) -> None:
    assert "nested" in str(refused(tmp_path, "a = " + "[" * 100_000))
    assert "10000001 bytes" in str(refused(tmp_path, b"#" * 10_000_001))
    assert "TOML" in str(refused(tmp_path, "a = " + "9" * 10_000))
    assert "36000 bits" in str(refused(tmp_path, HALL.replace("80.0", "0x" + "f" * 9000)))
    assert len(str(refused(tmp_path, "a" * 1_000_000 + " = 1"))) < 500


@pytest.mark.parametrize(("name", "words"), [("absent.toml", "no such file"), (".", "folder"), ("a\0b", "a.x00b: ")])
def test_refuses_a_path_that_is_no_file(tmp_path: Path, name: str, words: str) -> None:
    with pytest.raises(RobotFileError, match=words) as caught:
        read_robot(tmp_path / name)
    assert len(str(caught.value).splitlines()) == 1


def test_every_message_names_its_file_first(tmp_path: Path) -> None:
    error = refused(tmp_path, HALL.replace("mass = 80.0", "mass = -1"))
    hint = "give the platform's mass in kg"
    assert str(error) == f"{tmp_path / 'robot.toml'}: platform.mass: is -1.0, must be above 0 kg; {hint}"


@settings(max_examples=200, deadline=None)
@given(
    place=st.integers(0, len(HALL)),
    length=st.integers(0, 30),
    patch=st.binary(max_size=30) | st.text(max_size=9),
)
def test_damaged_files_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, place: int, length: int, patch: bytes | str
) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.toml"
    put = patch if isinstance(patch, bytes) else patch.encode()
    path.write_bytes(HALL[:place].encode() + put + HALL[place + length :].encode())
    try:
        assert len(read_robot(path).cables) == 3
    except InputError as error:
        assert len(str(error).splitlines()) == 1
