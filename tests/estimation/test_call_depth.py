"""How deep a newcomer has to read: calls of our own between the command and the optimiser."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import tautwire
from tautwire import estimation
from tautwire.cli import run
from tautwire.estimation import parameter_fit, profile_likelihood
from tests.support.robots import EXAMPLES

OWN = Path(tautwire.__file__).parent
MAX_CALLS = 12
Calls = tuple[str, ...]


def own_calls() -> Calls:
    """Functions of the project that are being run, the outermost first."""
    calls, frame = [], sys._getframe(1)
    while frame.f_back is not None:
        frame = frame.f_back
        file = Path(frame.f_code.co_filename)
        if file.is_relative_to(OWN):
            calls.append(f"{file.stem}.{frame.f_code.co_name}")
    return tuple(reversed(calls))


@pytest.fixture
def paths(monkeypatch: pytest.MonkeyPatch) -> set[Calls]:
    """Calls that led to the optimiser, wherever it is called."""
    noted: set[Calls] = set()
    for module in (parameter_fit, profile_likelihood):
        optimise = module.least_squares

        def least_squares(*arguments: Any, optimise: Any = optimise, **options: Any) -> Any:
            noted.add(own_calls())
            return optimise(*arguments, **options)

        monkeypatch.setattr(module, "least_squares", least_squares)
    return noted


@pytest.mark.validate
def test_the_optimiser_is_at_most_twelve_calls_from_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, paths: set[Calls]
) -> None:
    monkeypatch.setattr(estimation, "processors", lambda: 1)
    files = [tmp_path / name for name in ("fit.csv", "check.csv")]
    for file in files:
        pd.read_csv(EXAMPLES / "three" / file.name).head(300).to_csv(file, index=False)
    fit, check = map(str, files)
    robot = str(EXAMPLES / "three/robot.toml")
    assert run(["trace", robot, fit, "--check", check, "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert all(path[1] == "identification_commands.trace" for path in paths)
    deepest = max(paths, key=len)
    assert deepest[-1] == "parameter_fit.fit_from"
    assert len(deepest) <= MAX_CALLS, " -> ".join(deepest)
