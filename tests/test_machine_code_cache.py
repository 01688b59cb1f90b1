"""Machine code on disk: the same numbers whatever the cache holds, one file for functions that differ in numbers."""

import os
import sys
from pathlib import Path

import casadi
import numpy as np
import pytest
from casadi import SX, Function

from tautwire.estimation.native_functions import CompiledFunction
from tautwire.machine_code_cache import CACHE_VARIABLE, DIGEST_BYTES, cached_machine_code

ARGUMENT = np.linspace(-1.0, 1.0, 7)[None, :]


def results(gain: float, offset: float) -> np.ndarray:
    a = SX.sym("a")
    compiled = CompiledFunction(Function("line", [a], [gain * np.pi * casadi.sin(a) + offset / 7.0]))
    (values,) = compiled(ARGUMENT.shape[1], ARGUMENT)
    return values


def kept(folder: Path) -> list[Path]:
    return sorted((folder / "machine-code").iterdir())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    return tmp_path


def test_results_are_the_same_with_cold_warm_damaged_and_no_cache(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cold = results(0.3, 0.1)
    (file,) = kept(folder)
    whole = file.read_bytes()
    warm = results(0.3, 0.1)
    damages = (b"", b"something else", whole[: len(whole) // 2], whole[:40] + bytes([whole[40] ^ 1]) + whole[41:])
    for damaged in damages:
        file.write_bytes(damaged)
        np.testing.assert_array_equal(results(0.3, 0.1), cold)
        assert kept(folder) == [file]
        assert file.read_bytes() == whole
    monkeypatch.setenv(CACHE_VARIABLE, "")
    file.unlink()
    np.testing.assert_array_equal(results(0.3, 0.1), cold)
    np.testing.assert_array_equal(warm, cold)
    assert kept(folder) == []


def test_functions_that_differ_in_numbers_share_a_file(folder: Path) -> None:
    one, other = results(0.3, 0.1), results(-2.7, 1e-9)
    assert len(kept(folder)) == 1
    np.testing.assert_allclose(one, 0.3 * np.pi * np.sin(ARGUMENT) + 0.1 / 7.0, rtol=1e-15)
    np.testing.assert_allclose(other, -2.7 * np.pi * np.sin(ARGUMENT) + 1e-9 / 7.0, rtol=1e-15)


def test_what_was_kept_is_not_compiled_again(folder: Path) -> None:
    compiled: list[bytes] = []

    def compile_content() -> bytes:
        compiled.append(b"code")
        return b"code"

    assert [cached_machine_code(b"text", compile_content) for _ in range(3)] == [b"code"] * 3
    assert cached_machine_code(b"another text", compile_content) == b"code"
    assert len(compiled) == 2


def test_the_cache_is_bounded_and_loses_what_is_unused_for_longest(folder: Path) -> None:
    rng = np.random.default_rng(1)
    size, max_bytes = 1000, 30_000
    contents = [f"text {number}".encode() for number in range(120)]
    # Noise cannot be compressed, so a file has the size of its code.
    codes = [rng.bytes(size) for _ in contents]
    for content, code in zip(contents, codes, strict=True):
        cached_machine_code(contents[0], lambda: codes[0], max_bytes)
        cached_machine_code(content, lambda code=code: code, max_bytes)  # type: ignore[misc]
        for file in kept(folder):
            os.utime(file, ns=(file.stat().st_atime_ns, file.stat().st_mtime_ns - 10**9))
    # Between two cleanings some more may be written than the bound.
    assert sum(file.stat().st_size for file in kept(folder)) < 3 * max_bytes
    assert len(kept(folder)) < len(contents) // 2
    assert cached_machine_code(contents[0], lambda: b"compiled anew", max_bytes) == codes[0]
    assert cached_machine_code(contents[1], lambda: b"compiled anew", max_bytes) == b"compiled anew"


@pytest.mark.parametrize("variable", [CACHE_VARIABLE, "XDG_CACHE_HOME"])
def test_a_folder_that_cannot_be_made_is_done_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, variable: str
) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.delenv(CACHE_VARIABLE)
    monkeypatch.setenv(variable, str(tmp_path / "file"))
    assert cached_machine_code(b"text", lambda: b"code") == b"code"
    assert (tmp_path / "file").read_text() == "no folder"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such modes")
def test_only_the_user_may_write_what_will_be_executed(folder: Path) -> None:
    cached_machine_code(b"text", lambda: b"code")
    (file,) = kept(folder)
    assert len(file.read_bytes()) > DIGEST_BYTES
    assert file.parent.stat().st_mode & 0o077 == 0
    assert file.stat().st_mode & 0o077 == 0
