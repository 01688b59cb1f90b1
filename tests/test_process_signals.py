"""Interrupts are noted while foreign code runs, and raised where the program asks."""

import signal
from collections.abc import Iterator

import pytest

from tautwire.process_signals import defer_interrupts


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    before = signal.getsignal(signal.SIGINT)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_interrupt_waits_until_it_is_asked_for() -> None:
    reached = False
    with pytest.raises(KeyboardInterrupt), defer_interrupts() as raise_interrupt:
        signal.raise_signal(signal.SIGINT)
        reached = True
        raise_interrupt()
    assert reached


def test_an_interrupt_that_nobody_asked_for_is_raised_at_the_end_of_the_block() -> None:
    reached = False
    with pytest.raises(KeyboardInterrupt), defer_interrupts():
        signal.raise_signal(signal.SIGINT)
        reached = True
    assert reached


def test_an_interrupt_goes_before_the_error_that_it_caused() -> None:
    with pytest.raises(KeyboardInterrupt), defer_interrupts():
        signal.raise_signal(signal.SIGINT)
        raise OSError


def test_the_outer_of_two_blocks_hears_what_the_inner_raised() -> None:
    with defer_interrupts(), pytest.raises(KeyboardInterrupt), defer_interrupts() as raise_interrupt:
        signal.raise_signal(signal.SIGINT)
        raise_interrupt()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_process_that_ignores_interrupts_goes_on_doing_so() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with defer_interrupts() as raise_interrupt:
        signal.raise_signal(signal.SIGINT)
        raise_interrupt()
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
