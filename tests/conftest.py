from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tautwire.fmus.packaging import RobotFmus
from tests.support.built_once import fmus_built_once
from tests.support.rigid_robots import crane_robot
from tests.support.robots import LIMITED, example, paper_robot, with_damping, with_winch

if TYPE_CHECKING:
    from tests.support.browser.browser import Browser

# Modules by the time they take, so that none is left to one worker at the end. In a fresh clone the first compiles the
# filter, which the next ones do not need: two workers would compile it at once.
SLOWEST_FIRST = (
    "disturbance",
    "model_exchange_derivatives",
    "native_fmi3",
    "laboratory_files",
    "shared_recordings",
    "rigid_trace",
    "pages_in_browser",
    "paper_reproduction",
    "component_localisation",
    "native_whole_robots",
    "mistaken_motion",
    "legibility_in_browser",
    "dask_cluster",
    "trace_beside_disturbance",
    "planar_robots",
    "effects_in_fmus",
    "readme",
    "stepwise_selection",
    "rigid_effects",
    "black_box",
    "preprocessing",
    "importers",
    "batch_commands",
    "native_rigid_bodies",
    "native_fmus",
    "interrupted_commands",
    "confusable_models",
    "hostile_files",
    "sensor_offsets",
    "robust_design",
    "figure_tools_in_browser",
    "rigid_control",
    "commands",
    "laboratory_folder",
    "docs",
    "time_limit",
    "initial_motion",
    "unexplained_residual",
    "wheel",
    "c_toolchain",
    "uncertain_parameters",
    "shipped_recordings",
    "model_exchange_calls",
    "input_design",
    "campaign_run",
    "ringdown_damping",
    "robot_cosimulation",
    "tutorials",
    "controller_slave",
    "formula_discovery",
    "rigid_cosimulation",
    "clock_offsets",
    "material_identification",
    "mistaken_tracker",
    "profile_likelihood",
    "recording_notes",
    "controller_notes",
    "identifiability",
    "identification",
    "material_command",
    "platform_design",
    "user_fmus",
    "worker_pool",
    "rope_tests",
)


def pytest_configure() -> None:
    """Keep machine code in build/, not among the user's files, and each of several test processes on one processor.

    Traces then start no processes of their own, which would wait for those of the other tests.
    """
    os.environ["TAUTWIRE_CACHE"] = str(Path(__file__).resolve().parent.parent / "build" / "cache")
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker and hasattr(os, "sched_setaffinity"):
        processors = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {processors[int(worker.removeprefix("gw")) % len(processors)]})


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave in ``make test`` the cases that a ``validate`` mark excepts, and begin with the slowest modules."""
    for item in items:
        mark = item.get_closest_marker("validate")
        if mark and mark.kwargs and isinstance(item, pytest.Function) and _is_excepted(item.callspec.id, mark.kwargs):
            item.own_markers = [each for each in item.own_markers if each is not mark]
    ranks = {f"test_{name}": rank for rank, name in enumerate(SLOWEST_FIRST)}
    items.sort(key=lambda item: ranks.get(item.path.stem, len(ranks)))


def _is_excepted(case: str, words: Mapping[str, Sequence[str]]) -> bool:
    """Whether a case holds a word of ``but``, or none of ``only``."""
    if "only" in words:
        return not any(word in case for word in words["only"])
    return any(word in case for word in words["but"])


@pytest.fixture(scope="session")
def three_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """The paper's undamped three-cable robot, built once."""
    return fmus_built_once(paper_robot(), "three", tmp_path_factory)


@pytest.fixture(scope="session")
def damped_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """The paper's robot with its damping at 2 Hz."""
    return fmus_built_once(paper_robot(damping=2.08e9), "damped", tmp_path_factory)


@pytest.fixture(scope="session")
def winch_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """The paper's undamped robot on winches with limits."""
    return fmus_built_once(with_winch(paper_robot(), LIMITED), "winch", tmp_path_factory)


@pytest.fixture(scope="session")
def eight_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """The example with eight cables."""
    return fmus_built_once(with_damping(example("eight"), 3e8), "eight", tmp_path_factory)


@pytest.fixture(scope="session")
def crane_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """A rigid platform on eight cables."""
    return fmus_built_once(crane_robot(), "crane", tmp_path_factory)


@pytest.fixture(scope="session")
def native_crane_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """The same as machine code, for long runs."""
    return fmus_built_once(crane_robot(), "native-crane", tmp_path_factory, native=True)


@pytest.fixture(scope="session")
def native_winch_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """The robot on winches with limits as machine code, for long runs."""
    return fmus_built_once(with_winch(paper_robot(), LIMITED), "native-winch", tmp_path_factory, native=True)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """One browser for all tests of a file, which skips itself where there is none."""
    from tests.support.browser.browser import browser_at, chromium

    browser_path = chromium()
    assert browser_path is not None
    with browser_at(browser_path) as opened:
        yield opened


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Report pages of all kinds, for the browser."""
    from tests.support.browser.report_pages import report_pages

    return report_pages(tmp_path_factory.mktemp("pages"))
