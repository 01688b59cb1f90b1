"""The page that a whole run leaves: docs/tracer.md, made from the lines alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from tests.rig.lifelike.case import LEAST_RATIO

from . import tables
from .line import MINOR_SHARE
from .motion import MOTIONS
from .score import Scored, rate
from .sizes import NATS

COMMAND = "make bench-trace"
ALPHA = 0.01


def page(
    answers: Sequence[Scored],
    empty: Sequence[Scored],
    picture: str,
    lifelike: Sequence[Scored] = (),
    lifelike_empty: Sequence[Scored] = (),
) -> str:
    """All of it as Markdown; ``picture`` is the file of the confusion matrix beside it."""
    return (
        "\n\n".join(
            [
                "# The tracer, blind",
                f"Made by `{COMMAND}`; nothing here is written by hand. {_versions([*answers, *empty])}",
                _how(),
                "## Outcomes",
                tables.outcomes(answers),
                tables.meanings([*answers, *empty]),
                "## False alarms",
                _alarms(empty),
                "## What was hidden, and what was said",
                f"![Hidden by rows, said by columns]({picture})",
                tables.confusions(answers),
                "## Do the 95 % intervals hold the truth",
                "Of rightly named effects, every fitted parameter.",
                tables.coverage(answers),
                "## Error, and time",
                _errors(answers),
                tables.times([*answers, *empty]),
                tables.errors(answers),
                *(_lifelike(lifelike, lifelike_empty) if lifelike else ()),
            ]
        )
        + "\n"
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


def _lifelike(answers: Sequence[Scored], empty: Sequence[Scored]) -> list[str]:
    return [
        "## Robots as they are",
        "No robot is quite what its file says. `tests/rig/lifelike` draws robots of 1 m and 1 kg to 100 m and hundreds "
        "of kg on 3 to 8 cables, each recorded twice for 40 s at 100 Hz. Anchors, mass, moduli, dampings, and gains "
        "and zeros of the sensors are off within the uncertainties that the file states. Beside white noise there is "
        "noise that remembers, a random force on the platform, random tensions in the ropes, and by lot: little drag, "
        "friction, relaxation, an eccentric drum, backlash, belts, a frame that sways, a tracker that drops out and "
        "jumps, winch speeds from counts, drifting load cells, ropes that warm up. What is hidden changes positions or "
        f"tensions by {LEAST_RATIO:.0f} times or more of what all these do: an effect of the list in its own form "
        "(listed) or in another (form), two effects, what is on no list, or nothing. Right are exactly the names that "
        f"are hidden; a little thing may be named beside them with a share below {100 * MINOR_SHARE:.0f} %. One "
        "that is named with more, or alone where nothing is hidden, is there all the same: counted apart, as little.",
        _versions([*answers, *empty]),
        "### Outcomes of lifelike recordings",
        tables.outcomes(answers),
        tables.meanings([*answers, *empty]),
        "### False alarms of lifelike recordings",
        _alarms(empty),
        "### Named, missed, and named elsewhere",
        tables.names(answers),
        tables.confusions(answers),
        "### Do the 95 % intervals hold the truth there",
        "Of rightly named effects whose form is that of the list.",
        tables.coverage(answers),
        "### Error, and time, of lifelike recordings",
        "Size is by how many times as much as the little things the hidden one changes CHECK: positions, tensions.",
        tables.times([*answers, *empty]),
        tables.errors(answers),
    ]


def _alarms(empty: Sequence[Scored]) -> str:
    if not empty:
        return "None tried."
    answered = [answer for answer in empty if answer.outcome != "failed"]
    wrong = rate(sum(answer.outcome == "wrong" for answer in answered), len(answered))
    alarm = rate(sum(answer.outcome == "alarm" for answer in answered), len(answered))
    little = sum(answer.outcome == "little" for answer in answered)
    small = f" That of a thing which is there in small: {little} of {len(answered)}." if little else ""
    return (
        f"Robots that do what their files say, none of them among the cases above. A name where nothing is hidden: "
        f"{tables.shown_rate(wrong)}; `--alpha` was {ALPHA:g}.{small} "
        f"Unexplained or discovered: {tables.shown_rate(alarm)}. No answer: {len(empty) - len(answered)}."
    )


def _errors(answers: Sequence[Scored]) -> str:
    return (
        "Errors are those of the co-simulated FMUs on CHECK over what noise alone leaves there, of positions and of "
        f"tensions. At most 1.2 after the right name: {tables.shown_rate(tables.reached(answers))}. Traces ran each in "
        "a process and on a core of its own; the cases' times are of the processor, co-simulations included."
    )
