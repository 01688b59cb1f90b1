"""What a command writes to standard error beside its lines of progress."""

import re


def without_progress_lines(stderr: str) -> str:
    """The text without the lines that a long command writes every ten seconds."""
    return re.sub(r"^\d+ (s|min)( of at most \d+ (s|min))?: .*\n", "", stderr, flags=re.MULTILINE)
