"""What all clients do alike: read the run from ``run.json``, and write what came out."""

import json
import sys
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path


@dataclass(frozen=True)
class Task:
    """The run as ``client.py FOLDER STEP OUT.json`` asks for it.

    ``files`` are FMUs by component; ``connections`` are (source, output, target, input); ``position`` names three
    outputs of ``shown``; ``archive`` is the SSP file, ``components_only`` the folder with what is in it, whose
    SystemStructure.ssd has no connectors of its own.
    """

    folder: Path
    step: float
    out: Path
    files: dict[str, Path]
    connections: list[tuple[str, str, str, str]]
    shown: str
    position: list[str]
    stop: float
    archive: Path
    components_only: Path

    @property
    def count(self) -> int:
        """Number of steps."""
        return round(self.stop / self.step)


def read_task() -> Task:
    """The task on the command line."""
    folder, step, out = Path(sys.argv[1]).resolve(), float(sys.argv[2]), Path(sys.argv[3]).resolve()
    run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    return Task(
        folder=folder,
        step=step,
        out=out,
        files={name: folder / file for name, file in run["files"].items()},
        connections=[tuple(wire) for wire in run["connections"]],
        shown=run["shown"],
        position=run["position"],
        stop=run["stop"],
        archive=folder / run["archive"],
        components_only=folder / run["components_only"],
    )


def finish(task: Task, importer: str, position, seconds: float) -> None:
    """Write the end position (m) and how long the loop took."""
    result = {
        "importer": importer,
        "version": version(importer),
        "step": task.step,
        "steps": task.count,
        "position": [float(coordinate) for coordinate in position],
        "seconds": seconds,
        "steps_per_second": task.count / seconds,
    }
    task.out.write_text(json.dumps(result, indent=2), encoding="utf-8")
