"""The controllers' bench: ``python -m tests.bench.control [DOCS]`` prints tables, and writes them into DOCS/control.md.

Between the two marks there; the figure is DOCS/control.svg.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from tautwire.control import Design
from tautwire.cosimulation.robot_cosimulation import CosimulationResult
from tests.bench.control_figure import Curves, draw
from tests.bench.control_runs import (
    Controlled,
    Measured,
    Move,
    about_smooth,
    controlled,
    designs,
    measured,
    moves,
    robots,
    run,
)
from tests.bench.control_tables import margin_table, run_table

# When the shaped ramps have ended, in s.
SHAPED_BY = 6.5
BEGIN, END = "<!-- bench -->\n", "<!-- end of bench -->\n"
Runs = dict[str, tuple[Controlled, CosimulationResult]]
Pairs = dict[str, tuple[Measured, Measured]]


def compared(move: Move, feedback: dict[str, Design], folder: Path) -> tuple[Pairs, Runs]:
    """Each controller on the robot as declared and on those of the range; and the runs of the first."""
    controllers = controlled(move, feedback)
    nominal: dict[str, Measured] = {}
    worst: dict[str, Measured] = {}
    runs: Runs = {}
    for declared, fmus in robots(move, folder):
        for name, controller in controllers.items():
            motion = run(move, controller, fmus)
            result = measured(move, controller, motion)
            print(f"{move.name}: {name}, {'declared' if declared else 'off'}: {result}", file=sys.stderr, flush=True)
            if declared:
                nominal[name], runs[name] = result, (controller, motion)
            else:
                worst[name] = result.worst(worst.get(name, result))
    return {name: (nominal[name], worst[name]) for name in controllers}, runs


def distances(runs: Runs) -> Curves:
    """Distance from the path over time."""
    return {
        name: (motion.time, np.linalg.norm(motion.position - controller.path.position(motion.time), axis=1))
        for name, (controller, motion) in runs.items()
    }


def swings(runs: Runs, begin: float) -> Curves:
    """Swing in height after a time."""
    results = {}
    for name, (controller, motion) in runs.items():
        away = motion.position - controller.path.position(motion.time)
        results[name] = motion.time[motion.time >= begin], about_smooth(motion.time, away, begin)[:, 2]
    return results


def main(docs: Path | None) -> None:
    parts, runs, feedbacks = [], {}, {}
    with tempfile.TemporaryDirectory() as scratch:
        for place, move in enumerate(moves()):
            feedbacks[place] = designs(move)
            results, runs[place] = compared(move, feedbacks[place], Path(scratch) / str(place))
            parts.append(f"### {move.name}\n\n{run_table(results)}\n")
    helix, _, _, caroca, _ = moves()
    parts.append(f"### Margins, three cables\n\n{margin_table(helix.robot, helix.path, feedbacks[0])}\n")
    parts.append(f"### Margins, CAROCA\n\n{margin_table(caroca.robot, caroca.path, feedbacks[3])}\n")
    text = "\n".join(parts)
    print(text)
    if docs is not None:
        page = docs / "control.md"
        before, rest = page.read_text(encoding="utf-8").split(BEGIN)
        _, after = rest.split(END)
        page.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}", encoding="utf-8")
        curves = distances(runs[0]), swings(runs[1], SHAPED_BY), distances(runs[2])
        draw(*curves, helix.robot, feedbacks[0], docs / "control.svg")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
