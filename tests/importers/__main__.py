"""Prints the table of importers: ``python -m tests.importers [STEP ...]``."""

import sys
import tempfile
from pathlib import Path

import numpy as np

from tests.support.robots import paper_robot

from .harness import IMPORTERS, NotInstallableError, exact_end, prepare, run_client

STEPS = (0.01, 0.001)


def main(steps: tuple[float, ...]) -> None:
    robot = paper_robot()
    exact = exact_end(robot)
    print("| importer | version |" + "".join(f" error at {1e3 * step:g} ms |" for step in steps) + " steps/s |")
    print("| --- | --- |" + " --- |" * len(steps) + " --- |")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(robot, folder)
        for importer in IMPORTERS:
            try:
                results = [run_client(importer, folder, step) for step in steps]
            except NotInstallableError as error:
                print(f"| {importer.label} | not installed | {str(error).splitlines()[0]} |")
                continue
            errors = [1e3 * float(np.linalg.norm(result["position"] - exact)) for result in results]
            shown = "".join(f" {error:.2g} mm |" for error in errors)
            print(f"| {importer.label} | {results[0]['version']} |{shown} {results[-1]['steps_per_second']:.0f} |")


if __name__ == "__main__":
    main(tuple(map(float, sys.argv[1:])) or STEPS)
