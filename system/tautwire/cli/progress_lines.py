"""Progress as lines of text, for pipes and log files, where no progress bar can be drawn."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Event, Thread

LINE_INTERVAL = 10.0  # s
SECONDS_BELOW = 600.0


@dataclass(frozen=True)
class ActivityProgress:
    """Progress of one activity, ``fraction`` done at ``time`` (s), of which ``first_fraction`` at ``begun`` (s)."""

    activity: str
    begun: float
    first_fraction: float
    time: float
    fraction: float

    def updated(self, activity: str, fraction: float, now: float) -> ActivityProgress:
        """The progress with a newer fraction, or that of another activity from its beginning."""
        if activity != self.activity:
            return ActivityProgress(activity, now, fraction, now, fraction)
        return ActivityProgress(activity, self.begun, self.first_fraction, now, fraction)

    def remaining_time(self, now: float) -> float | None:
        """Remaining time of the activity in s, at its mean rate so far; None where it has not advanced."""
        advance = self.fraction - self.first_fraction
        if advance <= 0.0:
            return None
        at_last_report = (self.time - self.begun) * (1.0 - self.fraction) / advance
        return max(at_last_report - (now - self.time), 0.0)


def progress_line(progress: ActivityProgress, elapsed: float, now: float, time_limit: float | None = None) -> str:
    """A line such as ``20 s: co-simulating, 35 %, about 40 s left``; ``elapsed`` in s since the command began.

    With a ``time_limit`` in s of the whole command it begins ``20 s of at most 10 min``.
    """
    bound = "" if time_limit is None else f" of at most {duration_text(time_limit)}"
    parts = [f"{duration_text(elapsed)}{bound}: {progress.activity}"]
    remaining = progress.remaining_time(now)
    if remaining is not None:
        parts += [f"{100.0 * progress.fraction:.0f} %", f"about {duration_text(remaining)} left"]
    return ", ".join(parts)


def duration_text(duration: float) -> str:
    """A duration in s or min."""
    return f"{duration:.0f} s" if duration < SECONDS_BELOW else f"{duration / 60.0:.0f} min"


@contextmanager
def progress_lines(
    print_line: Callable[[str], None], time_limit: float | None = None, interval: float = LINE_INTERVAL
) -> Iterator[Callable[[str, float], None]]:
    """Context manager that prints the reported activity and fraction once every ``interval`` (s), see progress_line.

    A thread prints, since a compiled call may report nothing for longer than that.
    """
    begun = time.monotonic()
    ended = Event()
    latest: ActivityProgress | None = None

    def report_progress(activity: str, fraction: float) -> None:
        nonlocal latest
        now = time.monotonic()
        start = latest or ActivityProgress(activity, now, fraction, now, fraction)
        latest = start.updated(activity, fraction, now)

    def print_until_ended() -> None:
        while not ended.wait(interval):
            if latest is not None:
                now = time.monotonic()
                print_line(progress_line(latest, now - begun, now, time_limit))

    thread = Thread(target=print_until_ended, name="progress lines", daemon=True)
    thread.start()
    try:
        yield report_progress
    finally:
        ended.set()
        # Not for ever: nobody may be reading a full pipe.
        thread.join(timeout=1.0)
