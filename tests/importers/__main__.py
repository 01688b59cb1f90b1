"""Prints the table of importers: ``python -m tests.importers [STEP ...]``."""

import sys
import tempfile
from pathlib import Path

import numpy as np

from tests.support.robots import paper_robot

from .harness import IMPORTERS, NotInstallableError, exact_end, prepare, run_client

STEPS = (0.01, 0.001)
SAME = 1e-9  # m


def main(steps: tuple[float, ...]) -> None:
    robot = paper_robot()
    exact = exact_end(robot)
    errors_head = "".join(f" error at {1e3 * step:g} ms |" for step in steps)
    print(f"| importer | version |{errors_head} steps/s | native |")
    print("| --- | --- |" + " --- |" * len(steps) + " --- | --- |")
    with tempfile.TemporaryDirectory() as name:
        python, native = Path(name) / "python", Path(name) / "native"
        for folder in (python, native):
            folder.mkdir()
            prepare(robot, folder, native=folder == native)
        for importer in IMPORTERS:
            try:
                results = [run_client(importer, python, step) for step in steps]
                native_results = [run_client(importer, native, step) for step in steps]
            except NotInstallableError as error:
                print(f"| {importer.label} | not installed | {str(error).splitlines()[0]} |")
                continue
            errors = [1e3 * float(np.linalg.norm(result["position"] - exact)) for result in results]
            shown = "".join(f" {error:.2g} mm |" for error in errors)
            speeds = " | ".join(f"{each[-1]['steps_per_second']:.0f}" for each in (results, native_results))
            print(f"| {importer.label} | {results[0]['version']} |{shown} {speeds} |", flush=True)
            for one, other in zip(results, native_results, strict=True):
                distance = float(np.linalg.norm(np.array(one["position"]) - other["position"]))
                if distance > SAME:
                    print(f"native FMUs end {distance:.2g} m elsewhere")


if __name__ == "__main__":
    main(tuple(map(float, sys.argv[1:])) or STEPS)
