"""Calls in processes of their own, and what is left when they are ended."""

import os
import time
from pathlib import Path

import pytest

from tautwire.tracer.workers import Workers, processors


def square(number: int) -> int:
    return number * number


def fail(number: int) -> int:
    raise ValueError(f"no {number}")


def process(number: int) -> int:
    time.sleep(0.05 * number)
    return os.getpid()


def sleep_for_long(folder: Path) -> None:
    (folder / "begun").touch()
    time.sleep(600.0)


@pytest.mark.parametrize("count", [1, 2])
def test_each_call_is_answered_by_its_number(count: int) -> None:
    with Workers(count) as workers:
        assert dict(workers.each(square, [(3,), (4,), (5,)])) == {0: 9, 1: 16, 2: 25}
        assert workers.start(square, 6).result() == 36


def test_one_worker_is_this_process_and_two_are_others() -> None:
    with Workers(1) as alone, Workers(2) as apart:
        assert {result for _, result in alone.each(process, [(0,), (0,)])} == {os.getpid()}
        others = {result for _, result in apart.each(process, [(1,), (1,), (1,), (1,)])}
    assert len(others) == 2
    assert os.getpid() not in others


@pytest.mark.parametrize("count", [1, 2])
def test_what_a_call_raises_is_raised_here(count: int) -> None:
    with Workers(count) as workers:
        with pytest.raises(ValueError, match="no 7"):
            workers.start(fail, 7).result()
        with pytest.raises(ValueError, match="no 8"):
            list(workers.each(fail, [(8,)]))


def test_an_interrupt_ends_work_that_has_begun(tmp_path: Path) -> None:
    def stop_when_begun() -> None:
        if (tmp_path / "begun").exists():
            raise KeyboardInterrupt

    began = time.perf_counter()
    with pytest.raises(KeyboardInterrupt), Workers(2, stop_when_begun) as workers:
        workers.start(sleep_for_long, tmp_path).result()
    assert time.perf_counter() - began < 60.0


def test_there_is_at_least_one_processor() -> None:
    assert processors() >= 1
