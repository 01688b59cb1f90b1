"""Recordings longer than a trace can take: what is traced of them."""

from __future__ import annotations

from ...recordings.recording import Recording

# A fit runs a filter over each some hundred times, 30 us a sample.
MOST_SAMPLES = 100_000


def shortened(
    fit: Recording, check: Recording | None, most: int = MOST_SAMPLES
) -> tuple[Recording, Recording | None, tuple[str, ...]]:
    """The beginnings of two recordings, so many samples at most, and notes; of the only one, which judges too, twice.

    The beginning, and not samples here and there: ropes remember, so a model has to follow a recording from its start.
    """
    if check is None:
        short, notes = _first(fit, 2 * most)
        return short, None, notes
    (short, notes), (other, others) = _first(fit, most), _first(check, most)
    return short, other, (*notes, *others)


def _first(recording: Recording, most: int) -> tuple[Recording, tuple[str, ...]]:
    count = recording.sample_count
    if count <= most:
        return recording, ()
    short = recording.first(most)
    said = f"its first {short.duration:.4g} s, {most:,} of {count:,} samples, were traced; give another part for more"
    return short, (f"{recording.path}: {said}",)
