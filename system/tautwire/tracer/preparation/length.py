"""Truncation of recordings that are too long for estimation."""

from __future__ import annotations

from ...recordings.recording import Recording

# A fit runs the filter over each recording some hundred times, 30 us a sample.
MAX_SAMPLES = 100_000


def shortened(
    fit: Recording, check: Recording | None, most: int = MAX_SAMPLES
) -> tuple[Recording, Recording | None, tuple[str, ...]]:
    """Two recordings truncated to ``most`` samples, and notes; a single one, which also validates, to twice as many.

    The beginning is used and not every n-th sample: ropes have memory, so a model has to follow a recording from its
    start.
    """
    if check is None:
        short_fit, notes = _truncated(fit, 2 * most)
        return short_fit, None, notes
    (short_fit, notes), (short_check, check_notes) = _truncated(fit, most), _truncated(check, most)
    return short_fit, short_check, (*notes, *check_notes)


def _truncated(recording: Recording, max_samples: int) -> tuple[Recording, tuple[str, ...]]:
    count = recording.sample_count
    if count <= max_samples:
        return recording, ()
    short = recording.first(max_samples)
    description = f"its first {short.duration:.4g} s, {max_samples:,} of {count:,} samples, were traced; give another part for more"
    return short, (f"{recording.path}: {description}",)
