from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tautwire.fmus.packaging import RobotFmus, build_fmus
from tests.support.robots import LIMITED, example, paper_robot, with_damping, with_winch

if TYPE_CHECKING:
    from tests.support.browser.browser import Browser


@pytest.fixture(scope="session")
def three_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """The paper's undamped three-cable robot, built once."""
    return build_fmus(paper_robot(), tmp_path_factory.mktemp("three"))


@pytest.fixture(scope="session")
def damped_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """The paper's robot with its damping at 2 Hz."""
    return build_fmus(paper_robot(damping=2.08e9), tmp_path_factory.mktemp("damped"))


@pytest.fixture(scope="session")
def winch_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """The paper's undamped robot on winches with limits."""
    return build_fmus(with_winch(paper_robot(), LIMITED), tmp_path_factory.mktemp("winch"))


@pytest.fixture(scope="session")
def eight_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """The example with eight cables."""
    return build_fmus(with_damping(example("eight"), 3e8), tmp_path_factory.mktemp("eight"))


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """One browser for all tests of a file, which skips itself where there is none."""
    from tests.support.browser.browser import browser_at, chromium

    found = chromium()
    assert found is not None
    with browser_at(found) as opened:
        yield opened


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Report pages of all kinds, for the browser."""
    from tests.support.browser.report_pages import report_pages

    return report_pages(tmp_path_factory.mktemp("pages"))
