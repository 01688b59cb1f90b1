from pathlib import Path

import pytest

from tautwire.atomic_output import atomic_file, atomic_folder
from tautwire.errors import InputError


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_files_appear_when_the_block_ends_well(tmp_path: Path) -> None:
    target = tmp_path / "new" / "deep"
    with atomic_folder(target) as scratch:
        (scratch / "a").write_text("1")
        assert not target.exists()
    assert names(target) == ["a"]
    assert names(tmp_path) == ["new"]


def test_nothing_is_left_when_it_fails(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), atomic_folder(tmp_path / "new") as scratch:
        (scratch / "a").write_text("1")
        raise KeyboardInterrupt
    assert names(tmp_path) == []


def test_other_files_in_the_folder_stay(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("mine")
    (tmp_path / "a").write_text("old")
    with atomic_folder(tmp_path) as scratch:
        (scratch / "a").write_text("new")
    assert names(tmp_path) == ["a", "mine"]
    assert (tmp_path / "a").read_text() == "new"
    assert (tmp_path / "mine").read_text() == "mine"


def test_a_file_at_the_path_of_a_folder_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("")
    with pytest.raises(InputError, match="is a file"), atomic_folder(tmp_path / "a" / "b"):
        pass


def test_a_folder_at_the_path_of_a_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a folder"), atomic_file(tmp_path):
        pass


def test_a_file_is_replaced_whole(tmp_path: Path) -> None:
    target = tmp_path / "result.csv"
    target.write_text("old")
    with atomic_file(target) as scratch:
        scratch.write_text("half")
        assert target.read_text() == "old"
    assert target.read_text() == "half"
    assert names(tmp_path) == ["result.csv"]
