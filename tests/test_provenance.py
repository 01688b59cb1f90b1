"""Provenance: what it tells of version, command, date and inputs, in each form in which outputs hold it."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from urllib.parse import unquote

import pytest

import tautwire
from tautwire.errors import InputError
from tautwire.provenance import PROVENANCE_KEY, Provenance, command_text, provenance_of
from tautwire.toml_text import parse_toml

MADE = Provenance("0.1.0", "tautwire trace 'my robot.toml'", "2026-01-02T03:04:05Z", {"my robot.toml": "ab" * 32})


def test_inputs_are_named_as_the_command_had_them_with_their_hashes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("fit.csv").write_bytes(b"time\n" * 300_000)
    made = provenance_of(["fit.csv"], "tautwire trace fit.csv")
    assert made.version == tautwire.__version__
    assert made.inputs == {"fit.csv": hashlib.sha256(b"time\n" * 300_000).hexdigest()}
    assert str(tmp_path) not in json.dumps(made.document())
    assert provenance_of({"cable_1=own.fmu": Path("fit.csv")}).inputs.keys() == {"cable_1=own.fmu"}


def test_a_folder_stands_for_its_files(tmp_path: Path) -> None:
    (tmp_path / "run.mcap").write_bytes(b"a")
    (tmp_path / "metadata.yaml").write_bytes(b"b")
    (tmp_path / "notes").mkdir()
    hashes = {"bag/metadata.yaml": hashlib.sha256(b"b").hexdigest(), "bag/run.mcap": hashlib.sha256(b"a").hexdigest()}
    assert provenance_of({"bag": tmp_path}).inputs == hashes


def test_the_date_is_that_of_a_reproducible_build(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    assert provenance_of().created == "2023-11-14T22:13:20Z"
    assert provenance_of() == provenance_of()
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(InputError, match="SOURCE_DATE_EPOCH: 'yesterday' is not a date"):
        provenance_of()


def test_a_command_can_be_pasted_into_a_shell() -> None:
    assert command_text(["trace", "my robot.toml", "--out", "a&b"]) == "tautwire trace 'my robot.toml' --out 'a&b'"


@pytest.mark.parametrize("name", ["two\nlines = 1", "bell\x07", "\udcff.toml", "# command: x"])
def test_comments_are_toml_whatever_names_contain(name: str) -> None:
    comment = Provenance("0.1.0", command_text(["check", name]), MADE.created, {name: "ab" * 32}).comment()
    comment.encode("utf-8")
    assert parse_toml(comment) == {}
    assert len(comment.splitlines()) == 3


def test_metadata_hold_the_document() -> None:
    assert json.loads(MADE.schema_metadata()[PROVENANCE_KEY]) == MADE.document()
    of_csv = json.loads(MADE.csv_metadata("my run.csv"))
    assert of_csv["@context"] == "http://www.w3.org/ns/csvw"
    assert unquote(of_csv["url"]) == "my run.csv" and " " not in of_csv["url"]
    assert of_csv["notes"] == [{"provenance": MADE.document()}]
