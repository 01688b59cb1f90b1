"""Calls in processes of their own, and what is left when they are ended."""

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tautwire.estimation import worker_pool
from tautwire.estimation.worker_pool import WorkerLostError, WorkerPool, map_in_forks, processors


def square(number: int) -> int:
    return number * number


def fail(number: int) -> int:
    raise ValueError(f"no {number}")


def process(folder: Path, expected: int) -> int:
    """Its process, once as many as expected have begun."""
    (folder / str(os.getpid())).touch()
    until = time.monotonic() + 120.0
    while len(list(folder.iterdir())) < expected and time.monotonic() < until:
        time.sleep(0.01)
    return os.getpid()


def end_at_once() -> None:
    os._exit(3)


def sleep_for_long(folder: Path) -> None:
    (folder / "begun").touch()
    time.sleep(600.0)


@pytest.mark.validate
def test_processes_may_be_begun_before_there_is_work() -> None:
    with WorkerPool(1) as here, WorkerPool(2) as apart:
        here.warm_up()
        apart.warm_up()
        assert here.submit(square, 3).result() == apart.submit(square, 3).result() == 9


@pytest.mark.validate
@pytest.mark.parametrize("count", [1, 2])
def test_each_call_is_answered_by_its_number(count: int) -> None:
    with WorkerPool(count) as workers:
        assert dict(workers.map_unordered(square, [(3,), (4,), (5,)])) == {0: 9, 1: 16, 2: 25}
        assert workers.submit(square, 6).result() == 36


@pytest.mark.validate
def test_one_worker_is_this_process_and_two_are_others(tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    there.mkdir()
    with WorkerPool(1) as alone, WorkerPool(2) as apart:
        assert {result for _, result in alone.map_unordered(process, [(here, 1), (here, 1)])} == {os.getpid()}
        others = {result for _, result in apart.map_unordered(process, [(there, 2), (there, 2)])}
    assert len(others) == 2
    assert os.getpid() not in others


@pytest.mark.validate
@pytest.mark.parametrize("count", [1, 2])
def test_what_a_call_raises_is_raised_here(count: int) -> None:
    with WorkerPool(count) as workers:
        with pytest.raises(ValueError, match="no 7"):
            workers.submit(fail, 7).result()
        with pytest.raises(ValueError, match="no 8"):
            list(workers.map_unordered(fail, [(8,)]))


@pytest.mark.validate
def test_an_interrupt_ends_work_that_has_begun(tmp_path: Path) -> None:
    def stop_when_begun() -> None:
        if (tmp_path / "begun").exists():
            raise KeyboardInterrupt

    began = time.perf_counter()
    with pytest.raises(KeyboardInterrupt), WorkerPool(2, stop_when_begun) as workers:
        workers.submit(sleep_for_long, tmp_path).result()
    assert time.perf_counter() - began < 60.0


@pytest.mark.validate
def test_a_worker_that_ends_by_itself_is_told() -> None:
    with WorkerPool(2) as workers, pytest.raises(WorkerLostError, match="one of 2 worker processes"):
        workers.submit(end_at_once).result()
    with WorkerPool(2) as workers, pytest.raises(WorkerLostError, match="memory"):
        list(workers.map_unordered(end_at_once, [(), ()]))


def test_there_is_at_least_one_processor() -> None:
    assert processors() >= 1


def ignore(begun: int) -> None:
    """No report."""


@pytest.fixture
def two_processors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker_pool, "processors", lambda: 2)


@pytest.mark.parametrize("count", [0, 1, 2, 5])
@pytest.mark.usefixtures("two_processors")
def test_forks_answer_in_the_order_of_the_items(count: int) -> None:
    offset = 0.5
    assert map_in_forks(lambda item: item + offset, range(count), ignore) == [item + offset for item in range(count)]


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux only")
@pytest.mark.usefixtures("two_processors")
def test_every_second_item_is_of_a_fork_and_the_others_are_reported() -> None:
    reported: list[int] = []
    processes = map_in_forks(lambda _: os.getpid(), range(5), reported.append)
    assert processes[0::2] == [os.getpid()] * 3 and len(set(processes[1::2])) == 1
    assert processes[1] != os.getpid() and reported == [0, 2, 4]


def raise_at(place: int) -> Callable[[int], int]:
    def fail_there(item: int) -> int:
        return fail(item) if item == place else item

    return fail_there


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.usefixtures("two_processors")
def test_errors_of_forks_are_raised_as_they_are_here(place: int) -> None:
    with pytest.raises(ValueError, match=f"no {place}"):
        map_in_forks(raise_at(place), range(4), ignore)


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux only")
@pytest.mark.usefixtures("two_processors")
def test_a_fork_that_ends_is_an_error() -> None:
    parent = os.getpid()
    with pytest.raises(WorkerLostError):
        map_in_forks(lambda _: os.getpid() == parent or os._exit(3), range(2), ignore)


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux only")
@pytest.mark.usefixtures("two_processors")
def test_an_error_here_ends_the_fork(tmp_path: Path) -> None:
    parent = os.getpid()

    def work(item: int) -> None:
        if os.getpid() == parent:
            while not list(tmp_path.iterdir()):
                time.sleep(0.01)
            fail(item)
        (tmp_path / str(os.getpid())).touch()
        time.sleep(600.0)

    with pytest.raises(ValueError, match="no 0"):
        map_in_forks(work, range(2), ignore)
    (begun,) = tmp_path.iterdir()
    with pytest.raises(ProcessLookupError):
        os.kill(int(begun.name), 0)


class UnpicklableError(Exception):
    """An error that can be sent and not be made again."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(f"{first} {second}")


@pytest.mark.usefixtures("two_processors")
def test_an_error_of_a_fork_that_cannot_be_pickled_keeps_its_text() -> None:
    def work(item: int) -> None:
        if item == 1:
            raise UnpicklableError("no", "number")

    with pytest.raises(RuntimeError, match="UnpicklableError: no number"):
        map_in_forks(work, range(2), ignore)
