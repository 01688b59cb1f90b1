"""Memory and time of a long run: ``python -m tests.bench.long [STEPS]``, a million of 1 ms by default; Linux only."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tautwire.cosimulation.isolation import CALL_TIMEOUT
from tautwire.cosimulation.recording_simulation import read_recorded_inputs, simulate_recording
from tautwire.cosimulation.result_file import open_result_file
from tautwire.cosimulation.robot_wiring import result_columns
from tautwire.cosimulation.run_arguments import SimulationOptions
from tests.support.memory import resident_memory
from tests.support.robots import example, gentle_speeds

STEP = 1e-3
STEPS = 1_000_000


def write_recording(path: Path, steps: int) -> None:
    """Winch speeds at every step that keep the three-cable robot moving near its start."""
    time, speeds = gentle_speeds(example("three"), steps * STEP, STEP)
    names = [f"winch_speed_{cable}" for cable in range(1, speeds.shape[1] + 1)]
    table = pa.table(dict(zip(["time", *names], np.column_stack([time, speeds])[: steps + 1].T, strict=True)))
    pq.write_table(table, path)


def run(folder: Path, steps: int) -> None:
    """The run, as ``tautwire simulate`` makes it; a row of the table at every tenth of it."""
    robot = example("three")
    recording, result = folder / "recording.parquet", folder / "result.parquet"
    write_recording(recording, steps)
    begun, percents = perf_counter(), list(range(10, 101, 10))

    def tell(what: str, done: float) -> None:
        if percents and 100.0 * done >= percents[0]:
            seconds = perf_counter() - begun
            own, fmus = resident_memory()
            print(f"| {percents.pop(0)} % | {own:.1f} MB | {fmus:.1f} MB | {seconds:.0f} s |", flush=True)

    print("| done | resident memory | of the FMUs' process | wall time |\n| --- | --- | --- | --- |")
    with open_result_file(result, result_columns(robot.cable_count)) as rows:
        statistics, _ = simulate_recording(
            read_recorded_inputs(robot, recording), rows, SimulationOptions(STEP, call_timeout=CALL_TIMEOUT), tell
        )
    content = pq.ParquetFile(result).metadata
    print(
        f"\n{statistics.steps} steps, {statistics.iterations} iterations; "
        f"{content.num_rows} rows of {content.num_columns} numbers in "
        f"{content.num_row_groups} row groups, {result.stat().st_size / 1e6:.0f} MB on disk"
    )


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        run(Path(name), int(sys.argv[1]) if len(sys.argv) > 1 else STEPS)


if __name__ == "__main__":
    main()
