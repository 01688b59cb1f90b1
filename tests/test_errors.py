"""Errors carry their values, and their text is one line."""

import pickle

import pytest

from tautwire.errors import (
    InputError,
    RecordingError,
    RobotFileError,
    TautwireError,
    UnreachableError,
    format_value,
    one_line,
)


@pytest.mark.parametrize("kind", [InputError, RobotFileError, RecordingError])
def test_input_error_has_location_problem_and_hint(kind: type[InputError]) -> None:
    error = kind("hall.toml: cable[2].modulus", "is -1.0, must be above 0 Pa", "give the modulus")
    assert str(error) == "hall.toml: cable[2].modulus: is -1.0, must be above 0 Pa; give the modulus"
    assert (error.where, error.problem) == ("hall.toml: cable[2].modulus", "is -1.0, must be above 0 Pa")
    assert error.hint == "give the modulus"
    assert isinstance(error, TautwireError)


@pytest.mark.parametrize("strange", ["a\nb", "a\r\nb", "a\u2028b", "a\x1b[31mb", "a\udc80b", "a\x85b"])
def test_text_is_one_printable_line_whatever_the_file_is_called(strange: str) -> None:
    text = str(InputError(strange, strange, strange))
    assert len(text.splitlines()) == 1
    assert text.isprintable()
    assert text.encode("utf-8")


def test_ordinary_text_is_left_as_it_is() -> None:
    assert one_line("Große Halle 3.toml") == "Große Halle 3.toml"


def test_unreachable_error_names_cable_tension_and_position() -> None:
    error = UnreachableError("hall", position=(1.0, 2.0, 3.5), cable=2, tension=-35.25)
    assert (error.cable, error.tension, error.position) == (2, -35.25, (1.0, 2.0, 3.5))
    assert "[1, 2, 3.5] m" in str(error)
    assert "cable 2 would need -35.25 N" in str(error)


def test_unreachable_error_does_without_a_cable_to_blame() -> None:
    error = UnreachableError("hall", (0.0, 0.0, 0.0), None, None, reason="the cables lie in one plane")
    assert str(error).startswith("hall: the platform cannot be held at [0, 0, 0] m: the cables lie in one plane;")
    assert "None" not in str(error)


@pytest.mark.parametrize(
    "error",
    [RecordingError("f", "p", "m"), UnreachableError("hall", (1.0, 2.0, 3.0), 2, -35.25, reason="too high")],
)
def test_errors_survive_the_way_between_processes(error: InputError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert vars(again) == vars(error)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"),
        ("abc", "'abc'"),
        ({"a": 1}, "a table of 1 keys"),
        ([1, 2], "a list of 2"),
        (float("nan"), "nan"),
    ],
)
def test_values_are_shown_as_a_user_knows_them(value: object, text: str) -> None:
    assert format_value(value) == text


def test_long_values_are_cut() -> None:
    assert len(format_value("x" * 100_000)) < 70
    assert format_value(2**20000) == "a whole number of 20001 bits"
