"""The page of a run, written when the run is over, or when an FMU failed in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path

from ..errors import TautwireError
from ..master import Account
from ..output import file_in_place
from ..recordings.recording import read_recording
from ..robots.robot import Robot
from ..runs.result_file import Column
from .overview import Overview
from .run import Run
from .run_page import run_page

FEWEST_ROWS = 2


@contextmanager
def page_in_place(
    target: Path | None,
    robot: Robot,
    columns: Sequence[Column],
    overview: Overview,
    recording: Path,
    links: Mapping[str, str],
) -> Iterator[Callable[[Account, Sequence[str]], None]]:
    """Gives what to call with the books and notes of a run that ended well; without a ``target`` nothing is written.

    Where the block fails with a TautwireError, the page shows the run until then and the error goes on.

    Raises InputError where ``target`` cannot be written.
    """
    ended: list[tuple[Account, Sequence[str]]] = []
    failure: TautwireError | None = None
    with nullcontext() if target is None else file_in_place(target) as scratch:
        try:
            yield lambda account, notes: ended.append((account, notes))
        except TautwireError as error:
            if overview.count < FEWEST_ROWS:
                raise
            failure = error
        if scratch is not None:
            account, notes = ended[0] if ended else (None, ())
            names = tuple(column.name for column in columns[1:])
            driver, said = read_recording(recording, robot.cable_count), None if failure is None else str(failure)
            run = Run(robot, names, overview, driver, account, tuple(notes), said)
            scratch.write_text(run_page(run, links), encoding="utf-8")
    if failure is not None:
        raise failure
