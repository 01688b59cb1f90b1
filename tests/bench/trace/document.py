"""The page that whole parts of the benchmark leave: docs/tracer.md, made from the lines alone."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence

from tests.rig.lifelike.case import LEAST_RATIO

from . import tables
from .line import MINOR_SHARE
from .motion import MOTIONS
from .score import Scored, rate
from .sizes import NATS

COMMAND = "make bench-trace"
ALPHA = 0.01
EXACT = (
    "# The tracer, blind",
    "## Outcomes",
    "## What was hidden, and what was said",
    "## Do the 95 % intervals hold the truth",
    "## Error, and time",
)
EXACT_ALARMS = "## False alarms"
LIFELIKE = (
    "## Robots as they are",
    "### Outcomes of lifelike recordings",
    "### Named, missed, and named elsewhere",
    "### Do the 95 % intervals hold the truth there",
    "### Error, and time, of lifelike recordings",
)
LIFELIKE_ALARMS = "### False alarms of lifelike recordings"
PLATFORMS = (
    "## Platforms that turn",
    "### Outcomes on platforms",
    "### Named, missed, and named elsewhere on platforms",
    "### Do the 95 % intervals hold the truth on platforms",
    "### Error, and time, of platforms",
)
HEADINGS = (*EXACT[:2], EXACT_ALARMS, *EXACT[2:], *LIFELIKE[:2], LIFELIKE_ALARMS, *LIFELIKE[2:], *PLATFORMS)
SIZE = "Size is by how many times as much as the little things the hidden one changes CHECK: positions, tensions."
PLATFORM_ROBOTS = (
    "Rigid platforms on 4 and 8 cables, recorded with their orientation: exact but for white noise, and lifelike as "
    "above."
)


def page(old: str, sections: Mapping[str, str]) -> str:
    """The page ``old`` as Markdown with these sections, heading to text, in place of its own of the same headings.

    Parts of the benchmark take hours each, so that a session makes one anew and leaves the others as they stand; each
    says which version of the tracer answered.
    """
    merged = {**_sections(old), **sections}
    unknown = set(merged) - set(HEADINGS)
    if unknown:
        raise KeyError(f"not among the page's headings: {', '.join(sorted(unknown))}")
    return "\n\n".join(f"{heading}\n\n{merged[heading]}" for heading in HEADINGS if heading in merged) + "\n"


def exact(answers: Sequence[Scored], picture: str) -> dict[str, str]:
    """Sections of the exact recordings; ``picture`` is the file of the confusion matrix beside the page."""
    made = f"Made by `{COMMAND}`; nothing here is written by hand."
    texts = (
        f"{made} {_versions(answers)}\n\n{_how()}",
        f"{tables.outcomes(answers)}\n\n{tables.meanings(answers)}",
        f"![Hidden by rows, said by columns]({picture})\n\n{tables.confusions(answers)}",
        f"Of rightly named effects, every fitted parameter.\n\n{tables.coverage(answers)}",
        f"{_errors(answers)}\n\n{tables.times(answers)}\n\n{tables.errors(answers)}",
    )
    return dict(zip(EXACT, texts, strict=True))


def exact_alarms(empty: Sequence[Scored]) -> dict[str, str]:
    """The section of false alarms on exact recordings."""
    return {EXACT_ALARMS: _alarms(empty)}


def lifelike(answers: Sequence[Scored]) -> dict[str, str]:
    """Sections of the lifelike recordings."""
    texts = (f"{_little_things()}\n\n{_versions(answers)}", *_answered(answers))
    return dict(zip(LIFELIKE, texts, strict=True))


def lifelike_alarms(empty: Sequence[Scored]) -> dict[str, str]:
    """The section of false alarms on lifelike recordings."""
    return {LIFELIKE_ALARMS: _alarms(empty)}


def platforms(answers: Sequence[Scored]) -> dict[str, str]:
    """Sections of the platforms that turn."""
    return dict(zip(PLATFORMS, (f"{PLATFORM_ROBOTS}\n\n{_versions(answers)}", *_answered(answers)), strict=True))


def _sections(text: str) -> dict[str, str]:
    """Heading to text of a page as :func:`page` wrote it."""
    parts = re.split(r"^(#+ .+)$", text, flags=re.MULTILINE)
    return {heading: body.strip() for heading, body in zip(parts[1::2], parts[2::2], strict=True)}


def _answered(answers: Sequence[Scored]) -> tuple[str, ...]:
    """Outcomes, names, intervals, and errors with times."""
    return (
        f"{tables.outcomes(answers)}\n\n{tables.meanings(answers)}",
        f"{tables.names(answers)}\n\n{tables.confusions(answers)}",
        f"Of rightly named effects whose form is that of the list.\n\n{tables.coverage(answers)}",
        f"{SIZE}\n\n{tables.times(answers)}\n\n{tables.errors(answers)}",
    )


def _how() -> str:
    motions = "; ".join(f"`{name}` {m.duration:.0f} s at {m.rate:.0f} Hz" for name, m in MOTIONS.items())
    sizes = ", ".join(f"{size} {nats:.0e}".replace("e+0", "e") for size, nats in NATS.items())
    return (
        "The recordings come from the tests' rig, which has its own equations and shares no code with the project. "
        "The tracer gets the robot's file and two recordings whose names tell nothing. Robots: "
        f"{motions}. The start is at rest; noise of all sensors and of the winch speeds is what the robot's file "
        "says.\n\n"
        "How strong an effect is, is chosen by how well it shows, from the rig alone: the mean log-likelihood ratio, "
        "in nats, that separates the truth from the best model without the effect, where the change is linear, a "
        "constant of each output (but for a sensor that is off zero) and another modulus or damping of all cables are "
        "free, and noise of the winch speeds lets ropes drift (`tests/bench/trace/visible.py`). No method could have "
        "more. Sizes: "
        f"{sizes}; less where the largest plausible strength shows less. The strengths stand in "
        "`tests/bench/trace/sizes.json`; `python -m tests.bench.trace.sizes` makes it."
    )


def _versions(answers: Sequence[Scored]) -> str:
    """Which versions of the tracer gave how many of the answers, the newest of each case."""
    counts = Counter(answer.line.code for answer in answers)
    versions = ", ".join(f"{code} ({count})" for code, count in counts.most_common())
    return f"Answers by the tracer as of sources {versions}."


def _little_things() -> str:
    return (
        "No robot is quite what its file says. `tests/rig/lifelike` draws robots of 1 m and 1 kg to 100 m and hundreds "
        "of kg on 3 to 8 cables, each recorded twice for 40 s at 100 Hz. Anchors, mass, moduli, dampings, and gains "
        "and zeros of the sensors are off within the uncertainties that the file states. Beside white noise there is "
        "noise that remembers, a random force on the platform, random tensions in the ropes, and by lot: little drag, "
        "friction, relaxation, an eccentric drum, backlash, belts, a frame that sways, a tracker that drops out and "
        "jumps, winch speeds from counts, drifting load cells, ropes that warm up. What is hidden changes positions or "
        f"tensions by {LEAST_RATIO:.0f} times or more of what all these do: an effect of the list in its own form "
        "(listed) or in another (form), two effects, what is on no list, or nothing. Right are exactly the names that "
        f"are hidden; a little thing may be named beside them with a share below {100 * MINOR_SHARE:.0f} %. One "
        "that is named with more, or alone where nothing is hidden, is there all the same: counted apart, as little."
    )


def _alarms(empty: Sequence[Scored]) -> str:
    answered = [answer for answer in empty if answer.outcome != "failed"]
    wrong = rate(sum(answer.outcome == "wrong" for answer in answered), len(answered))
    alarm = rate(sum(answer.outcome == "alarm" for answer in answered), len(answered))
    little = sum(answer.outcome == "little" for answer in answered)
    small = f" That of a thing which is there in small: {little} of {len(answered)}." if little else ""
    return (
        f"Robots that do what their files say, none of them among the cases above. A name where nothing is hidden: "
        f"{tables.shown_rate(wrong)}; `--alpha` was {ALPHA:g}.{small} "
        f"Unexplained or discovered: {tables.shown_rate(alarm)}. No answer: {len(empty) - len(answered)}. "
        f"{_versions(empty)}\n\n{tables.times(empty)}"
    )


def _errors(answers: Sequence[Scored]) -> str:
    return (
        "Errors are those of the co-simulated FMUs on CHECK over what noise alone leaves there, of positions and of "
        f"tensions. At most 1.2 after the right name: {tables.shown_rate(tables.reached(answers))}. Traces ran each in "
        "a process and on a core of its own; the cases' times are of the processor, co-simulations included."
    )
