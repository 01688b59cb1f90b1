"""Time limit of an identification: searches end in time for the best answer so far, and it is told what they left."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import inf
from time import monotonic

from ..errors import TautwireError

DEFAULT_TIME_LIMIT = 600.0


class OutOfTimeError(TautwireError):
    """A search has used up its share of the time; carries the limit in s. Caught where something can go on without."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        super().__init__(f"the time limit of {seconds:g} s ended the search")


class TimeLimit:
    """Time limit in s, from when this is made, by a monotonic clock; ``untried`` are sentences on what was left out.

    Only in :meth:`searching` it ends anything: what has to follow a search needs its time too.
    """

    def __init__(self, seconds: float = DEFAULT_TIME_LIMIT, clock: Callable[[], float] = monotonic) -> None:
        self.seconds, self._clock = seconds, clock
        self._begin = clock()
        self._end_of_search = inf
        self._untried: dict[str, None] = {}

    @property
    def elapsed(self) -> float:
        """Seconds since this was made."""
        return self._clock() - self._begin

    @property
    def untried(self) -> tuple[str, ...]:
        """Sentences on what was left untried, in the order in which it was."""
        return tuple(self._untried)

    def leave_untried(self, sentence: str) -> None:
        """Tell what is left untried."""
        self._untried[sentence] = None

    @contextmanager
    def searching(self, share: float) -> Iterator[None]:
        """Context manager for a search that may go on until this share of the time is used up."""
        self._end_of_search = share * self.seconds
        try:
            yield
        finally:
            self._end_of_search = inf

    @contextmanager
    def suspended(self) -> Iterator[None]:
        """Context manager for what a search needs to judge what it has found, whatever the time."""
        end, self._end_of_search = self._end_of_search, inf
        try:
            yield
        finally:
            self._end_of_search = end

    def check(self) -> None:
        """Raises OutOfTimeError in a search whose time is used up."""
        if self.elapsed > self._end_of_search:
            raise OutOfTimeError(self.seconds)
