"""``python -m tests.bench.trace``: traces the cases that have no answer yet, prints the tables, writes the page."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from tests.support.robots import EXAMPLES

from . import document, tables
from .cases import Case, main_cases, quick_cases
from .figure import confusion_figure, save
from .lifelike_cases import ALARM as LIFELIKE_ALARM
from .lifelike_cases import lifelike_cases
from .line import Line, keep, read_lines
from .platform_cases import platform_cases
from .run import finished, run
from .score import Scored, outcome, scored
from .selection import ALARM, alarm_cases, chosen, code_version, lifelike_alarm_cases

ROOT = EXAMPLES.parents[2]
# The page's source, which goes with the repository: a part takes more hours than a session has.
ANSWERS = Path(__file__).with_name("answers.jsonl")
PICTURE = "tracer-confusion.svg"
# Fewer empty recordings do not go to the page.
FEWEST_ALARMS = 30


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
    parser.add_argument(
        "--folder", type=Path, default=ROOT / "build" / "bench-trace", help="recordings and new answers"
    )
    return parser.parse_args()


def main() -> None:
    asked = arguments()
    cases = chosen(cases_of(asked), asked.only)
    if asked.list:
        print("\n".join(case.key for case in cases))
        return
    kept = kept_with_results(asked.folder)
    if not asked.show:
        run(cases, asked.folder, code_version(), asked.jobs, tell, kept)
        kept = kept_with_results(asked.folder)
    show(scored(cases, finished(cases, kept)))
    write(kept)


def cases_of(asked: argparse.Namespace) -> Sequence[Case]:
    """All that the call is about."""
    if asked.empty:
        return lifelike_alarm_cases(asked.empty) if asked.lifelike else alarm_cases(asked.empty)
    if asked.platforms:
        return platform_cases()
    return lifelike_cases() if asked.lifelike else quick_cases() if asked.quick else main_cases()


def kept_with_results(folder: Path) -> tuple[Line, ...]:
    """The kept lines with those of the folder, but for such as another version of the tracer left there long ago."""
    answered = {line.key for line in read_lines(ANSWERS)}
    results = read_lines(folder / "results.jsonl")
    return keep(ANSWERS, [line for line in results if line.code == code_version() or line.key not in answered])


def tell(case: Case, line: Line) -> None:
    """One line as an answer comes."""
    said = " + ".join(f"{e.name}{list(e.cables)}" for e in line.effects) or line.verdict
    said = said or line.failure.strip().splitlines()[-1]
    print(f"{case.key}: {outcome(case, line)}: {said} ({line.processor:.0f} s)", flush=True)


def show(answers: Sequence[Scored]) -> None:
    """All tables."""
    for text in (tables.outcomes, tables.names, tables.confusions, tables.coverage, tables.times, tables.errors):
        print(f"\n{text(answers)}")


def write(lines: Sequence[Line]) -> None:
    """The page and its picture in docs, with the parts whose every case has an answer; the others stay as they are.

    Of each case the newest answer counts; the page tells by which versions of the tracer.
    """
    sections = finished_sections(lines)
    path = ROOT / "docs" / "tracer.md"
    if document.EXACT[0] in sections:
        save(confusion_figure(scored(main_cases(), finished(main_cases(), lines))), str(path.with_name(PICTURE)))
    if sections:
        old = path.read_text(encoding="utf-8") if path.exists() else ""
        path.write_text(document.page(old, sections), encoding="utf-8")
        print(f"\n{path}: {'; '.join(heading.lstrip('# ') for heading in sections)}")


def finished_sections(lines: Sequence[Line]) -> dict[str, str]:
    """The page's sections, heading to text, of the parts whose every case has an answer."""
    parts: tuple[tuple[Sequence[Case], Callable[[Sequence[Scored]], dict[str, str]]], ...] = (
        (main_cases(), partial(document.exact, picture=PICTURE)),
        (alarm_cases(_alarms_in(lines, f"{ALARM}-")), document.exact_alarms),
        (lifelike_cases(), document.lifelike),
        (lifelike_alarm_cases(_alarms_in(lines, LIFELIKE_ALARM)), document.lifelike_alarms),
        (platform_cases(), document.platforms),
    )
    sections: dict[str, str] = {}
    for cases, sections_of in parts:
        answers = scored(cases, finished(cases, lines))
        if answers and len(answers) == len(cases):
            sections |= sections_of(answers)
    return sections


def _alarms_in(lines: Sequence[Line], prefix: str) -> int:
    numbers = [int(line.key.removeprefix(prefix)) for line in lines if line.key.startswith(prefix)]
    count = max(numbers, default=-1) + 1
    return count if count >= FEWEST_ALARMS else 0


if __name__ == "__main__":
    main()
