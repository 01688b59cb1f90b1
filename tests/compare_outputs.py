"""Results of one tree of the project against those of another, bit for bit.

    python -m tests.compare_outputs make FOLDER        what the installed commands make, into a folder
    python -m tests.compare_outputs compare OLD NEW    what differs between two such folders; exit status 1 if any does

``make`` runs the commands of the README on the shipped examples, and traces the recordings beside the project where
there are any. ``compare`` passes over what says when, how long and where: seconds, dates, paths of files.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "system/tautwire/examples"
SHARED = ROOT.parent / "shared/recordings"
VOLATILE = {"seconds", "date", "command", "version", "folder", "file", "fmus", "path"}
PLAN = """robot = "{robot}"
seed = 1
controllers = ["none", "lqg"]

[sample]
method = "sobol"
count = 4

[vary]
"platform.mass" = {{uniform = [280.0, 320.0]}}

[[path]]
name = "up"
end = [29.5, 0.7, 6.2]
duration = 2.0
"""


def commands(out: Path) -> Iterator[tuple[str, list[str]]]:
    """Name and arguments of each command that is run."""
    for name in ("three", "caroca", "eight"):
        robot, check = EXAMPLES / name / "robot.toml", EXAMPLES / name / "check.csv"
        yield f"simulate-{name}", ["simulate", str(robot), "--speeds", str(check), "--out", str(out / f"{name}.csv")]
        yield f"linearise-{name}", ["linearise", str(robot), "--out", str(out / f"{name}.json")]
        yield f"fmus-{name}", ["fmus", str(robot), "--json"]
    three = str(EXAMPLES / "three/robot.toml")
    yield "workspace", ["workspace", three, "--out", str(out / "workspace.csv")]
    yield "material", ["material", "--robot", three, "--out", str(out / "material")]
    excitation = ["--effects", "damping,relaxation", "--duration", "8", "--programs", "6"]
    yield "excite", ["excite", three, *excitation, "--out", str(out / "program.csv")]
    plan = out / "plan.toml"
    plan.write_text(PLAN.format(robot=three), encoding="utf-8")
    yield "campaign", ["campaign", str(plan), "--out", str(out / "campaign"), "--workers", "1"]
    traced = [EXAMPLES / "three", *(folder for folder in sorted(SHARED.glob("?")) if folder.is_dir())]
    for folder in traced:
        files = [str(folder / "robot.toml"), str(folder / "fit.csv"), "--check", str(folder / "check.csv")]
        yield f"trace-{folder.name}", ["trace", *files, "--out", str(out / f"trace-{folder.name}")]


def make(out: Path, only: str) -> None:
    """Run all commands whose name holds ``only``; a line with what each one printed goes to ``printed.json``."""
    out.mkdir(parents=True, exist_ok=True)
    printed: dict[str, list[object]] = {}
    for name, arguments in commands(out):
        if only not in name:
            continue
        done = subprocess.run([sys.executable, "-m", "tautwire.cli", *arguments], capture_output=True, text=True)
        printed[name] = [done.returncode, done.stdout.replace(str(out), "OUT").replace(str(ROOT), "ROOT")]
        print(name, done.returncode, done.stderr.strip()[-200:] if done.returncode else "", flush=True)
    (out / f"printed{only}.json").write_text(json.dumps(printed, indent=1), encoding="utf-8")


def _differences(where: str, old: object, new: object) -> Iterator[str]:
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted((old.keys() | new.keys()) - VOLATILE):
            yield from _differences(f"{where}.{key}", old.get(key), new.get(key))
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for index, (a, b) in enumerate(zip(old, new, strict=True)):
            yield from _differences(f"{where}[{index}]", a, b)
    elif old != new and not (old != old and new != new):
        yield f"{where}: {old!r} -> {new!r}"


def compare(old: Path, new: Path) -> int:
    """Print all differences of the JSON, TOML, CSV and Parquet files of two folders; 1 if there are any."""
    import pandas as pd

    names = {path.relative_to(f).as_posix() for f in (old, new) for path in f.rglob("*") if path.is_file()}
    differences = []
    compared = 0
    for name in sorted(names):
        if Path(name).suffix not in {".json", ".toml", ".csv", ".parquet"} or name == "plan.toml":
            continue
        compared += 1
        a, b = old / name, new / name
        if not (a.is_file() and b.is_file()):
            differences.append(f"{name}: only in {'old' if a.is_file() else 'new'}")
        elif name.endswith(".json"):
            differences += _differences(name, json.loads(a.read_text()), json.loads(b.read_text()))
        elif name.endswith(".parquet"):
            volatile = [column for column in pd.read_parquet(a).columns if column in VOLATILE]
            if not pd.read_parquet(a).drop(columns=volatile).equals(pd.read_parquet(b).drop(columns=volatile)):
                differences.append(f"{name}: rows differ")
        elif a.read_bytes() != b.read_bytes():
            differences.append(f"{name}: bytes differ")
    print(*differences, sep="\n")
    print(f"{compared} files compared, {len(differences)} differences")
    return 1 if differences else 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=("make", "compare"))
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--only", default="", help="make: only commands whose name holds this")
    arguments = parser.parse_args()
    if arguments.action == "make":
        make(arguments.folders[0].absolute(), arguments.only)
    else:
        sys.exit(compare(*arguments.folders))


if __name__ == "__main__":
    main()
