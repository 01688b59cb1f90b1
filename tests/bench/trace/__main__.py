"""``python -m tests.bench.trace``: traces the cases that have no answer yet, prints the tables, writes the page."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from tests.support.robots import EXAMPLES

from . import tables
from .cases import Case, main_cases, quick_cases
from .document import page
from .figure import confusion_figure, save
from .lifelike_cases import ALARM as LIFELIKE_ALARM
from .lifelike_cases import lifelike_cases
from .line import Line, read_lines
from .platform_cases import platform_cases
from .run import finished, run
from .score import Scored, outcome, scored
from .selection import ALARM, alarm_cases, chosen, code_version, lifelike_alarm_cases

ROOT = EXAMPLES.parents[2]
PICTURE = "tracer-confusion.svg"


def arguments() -> argparse.Namespace:
    """What the call asks for."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.trace", description=__doc__)
    parser.add_argument("--only", action="append", default=[], metavar="TEXT", help="cases whose name holds TEXT")
    parser.add_argument("--jobs", type=int, default=1, help="processes at once")
    parser.add_argument("--quick", action="store_true", help="a look: robot three, middle size")
    parser.add_argument("--empty", type=int, default=0, metavar="N", help="false alarms on N empty recordings instead")
    parser.add_argument("--lifelike", action="store_true", help="robots as they are, also with --empty")
    parser.add_argument("--platforms", action="store_true", help="platforms that turn, exact and lifelike")
    parser.add_argument("--list", action="store_true", help="name the cases and stop")
    parser.add_argument("--show", action="store_true", help="trace nothing; show the newest answers")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "bench-trace", help="where answers are kept")
    return parser.parse_args()


def main() -> None:
    asked = arguments()
    cases = chosen(cases_of(asked), asked.only)
    if asked.list:
        print("\n".join(case.key for case in cases))
        return
    old = read_lines(asked.folder / "results.jsonl")
    lines = finished(cases, old) if asked.show else run(cases, asked.folder, code_version(), asked.jobs, tell)
    show(scored(cases, lines))
    write(asked.folder)


def cases_of(asked: argparse.Namespace) -> Sequence[Case]:
    """All that the call is about."""
    if asked.empty:
        return lifelike_alarm_cases(asked.empty) if asked.lifelike else alarm_cases(asked.empty)
    if asked.platforms:
        return platform_cases()
    return lifelike_cases() if asked.lifelike else quick_cases() if asked.quick else main_cases()


def tell(case: Case, line: Line) -> None:
    """One line as an answer comes."""
    said = " + ".join(f"{e.name}{list(e.cables)}" for e in line.effects) or line.verdict
    said = said or line.failure.strip().splitlines()[-1]
    print(f"{case.key}: {outcome(case, line)}: {said} ({line.processor:.0f} s)", flush=True)


def show(answers: Sequence[Scored]) -> None:
    """All tables."""
    for text in (tables.outcomes, tables.names, tables.confusions, tables.coverage, tables.times, tables.errors):
        print(f"\n{text(answers)}")


def write(folder: Path) -> None:
    """The page and its picture into docs, if every case has an answer; else into the folder, as far as it goes.

    Of each case the newest answer counts; the page tells by which versions of the tracer.
    """
    lines = read_lines(folder / "results.jsonl")

    def answered(cases: Sequence[Case]) -> tuple[Scored, ...]:
        return scored(cases, finished(cases, lines))

    answers, lifelike = answered(main_cases()), answered(lifelike_cases())
    empty = answered(alarm_cases(_alarms_in(lines, f"{ALARM}-")))
    lifelike_empty = answered(lifelike_alarm_cases(_alarms_in(lines, LIFELIKE_ALARM)))
    if not answers:
        return
    is_whole = len(answers) == len(main_cases()) and len(lifelike) == len(lifelike_cases())
    place = ROOT / "docs" if is_whole else folder
    place.mkdir(exist_ok=True)
    save(confusion_figure(answers), str(place / PICTURE))
    (place / "tracer.md").write_text(page(answers, empty, PICTURE, lifelike, lifelike_empty), encoding="utf-8")
    counts = f"{len(answers)} cases, {len(empty)} empty recordings"
    counts += f"; lifelike: {len(lifelike)} cases, {len(lifelike_empty)} empty recordings"
    print(f"\n{place / 'tracer.md'}: {counts}")


def _alarms_in(lines: Sequence[Line], prefix: str) -> int:
    numbers = [int(line.key.removeprefix(prefix)) for line in lines if line.key.startswith(prefix)]
    return max(numbers, default=-1) + 1


if __name__ == "__main__":
    main()
