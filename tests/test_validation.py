"""Rules of single values: each error names the value, the bound and a hint."""

from __future__ import annotations

import math
import os
import pickle
import sys
from pathlib import Path

import pytest

from tautwire.errors import ArgumentError, InputError, TautwireError
from tautwire.validation import (
    NumberRule,
    validate_attributes,
    validate_callable,
    validate_file,
    validate_folder,
    validate_instance,
    validate_integer,
    validate_number,
)
from tests.support.refusals import refused

SPAN = NumberRule("the span", "m", positive=True)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0, ("0.0", "above 0 m")),
        (1e16, ("1e+16", "at most 1e+15 m")),
        (math.nan, ("nan", "finite")),
        (math.inf, ("inf", "finite")),
        pytest.param(10**400, ("inf", "finite"), id="vast"),
        ("1", ("'1'", "not a number")),
        (True, ("true", "not a number")),
        (1 + 2j, ("a complex", "not a number")),
        (None, ("None", "not a number")),
    ],
)
def test_a_number_keeps_its_rule(value: object, words: tuple[str, ...]) -> None:
    refused(lambda: validate_number("span: length", value, SPAN), "span: length", "give the span in m", *words)


def test_infinity_passes_where_it_means_no_bound() -> None:
    assert validate_number("span: length", math.inf, SPAN, allow_infinite=True) == math.inf
    refused(lambda: validate_number("span: length", -math.inf, SPAN, allow_infinite=True), "span: length", "finite")


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (1, ("1", "at least 2")),
        (101, ("101", "at most 100")),
        pytest.param(2**2000, ("a whole number of 2001 bits", "at most 100"), id="vast"),
        (3.0, ("3.0", "not a whole number")),
        (True, ("true", "not a whole number")),
    ],
)
def test_a_whole_number_lies_between_its_bounds(value: object, words: tuple[str, ...]) -> None:
    refused(lambda: validate_integer("span: count", value, 2, "give some", 100), "span: count", *words)
    assert [validate_integer("span: count", good, 2, "give some", 100) for good in (2, 100)] == [2, 100]
    assert validate_integer("span: count", 10**9, 2, "give some") == 10**9


def test_a_value_is_of_its_class_or_has_what_is_asked_of_it() -> None:
    refused(lambda: validate_instance("a", "text", int, "give one"), "a", "'text'", "must be an int")
    refused(
        lambda: validate_attributes("a", 3, ("real", "duration"), "path", "give one"), "a", "no path", "no duration"
    )
    refused(lambda: validate_attributes("a", int, ("real",), "number", "give one"), "a", "the class int")
    refused(lambda: validate_callable("a", 3), "a", "not a function")
    assert (
        validate_instance("a", 3, int, ""),
        validate_attributes("a", 3, ("real",), "", ""),
        validate_callable("a", None),
    ) == (3, 3, None)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("a" * 5000, ("'aaa", "cannot be looked up")),
        ("a\ud800", (r"'a\ud800'", "cannot be looked up", "surrogates")),
        ("a\0b", (r"'a\x00b'", "cannot be looked up", "null")),
    ],
    ids=["too long", "lone surrogate", "zero"],
)
@pytest.mark.skipif(sys.platform == "win32", reason="names there have other bounds")
def test_a_path_that_the_system_does_not_take_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, words: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    refused(lambda: validate_folder("build: folder", name), "build: folder", "name a folder", *words)
    refused(lambda: validate_file("build: file", name), "build: file", "check the path", *words)


def test_a_folder_may_be_absent_but_nothing_else_may_be_in_its_place(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    assert validate_folder("a", str(tmp_path)) == validate_folder("a", tmp_path) == tmp_path
    assert validate_folder("a", tmp_path / "absent" / "inner") == tmp_path / "absent" / "inner"
    refused(lambda: validate_folder("a", file), "a", "not a folder")
    refused(lambda: validate_folder("a", 3), "a", "3", "not a path")
    (tmp_path / "loop").symlink_to("loop")
    for nowhere in (file / "inner", tmp_path / "loop"):
        refused(lambda nowhere=nowhere: validate_folder("a", nowhere), "a", "cannot be looked up")  # type: ignore[misc]


def test_a_file_is_there_and_is_no_folder(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    assert validate_file("a", os.fspath(file)) == file
    for wrong in (tmp_path, tmp_path / "absent"):
        refused(lambda wrong=wrong: validate_file("a", wrong), "a", "but there is no file")  # type: ignore[misc]


def test_the_error_keeps_the_value_on_its_way_between_processes() -> None:
    error = ArgumentError("Line: duration", -1.0, "is -1.0, must be above 0 s", "give a time")
    again = pickle.loads(pickle.dumps(error))
    assert (again.value, str(again)) == (-1.0, str(error))
    assert isinstance(error, InputError) and isinstance(error, TautwireError)
