"""The residual file of a trace: each sample of each recording beside both co-simulations, and its innovations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ..estimation.trace_result import Comparison, Trace
from ..provenance import Provenance
from ..robot.schema import AXES

RESIDUAL_FILE = "residuals.parquet"


def write_residuals(trace: Trace, path: Path, provenance: Provenance | None = None) -> None:
    """Write the measured, both co-simulated outputs and the innovations, a group of rows for each recording."""
    outputs = [(axis, "m") for axis in AXES]
    outputs += [(f"tension_{cable}", "N") for cable in trace.robot_before.cable_numbers]
    schema = _schema(outputs).with_metadata(provenance.schema_metadata() if provenance else None)
    with pq.ParquetWriter(path, schema, use_dictionary=["recording"]) as writer:
        for comparison in trace.comparisons:
            writer.write_table(_table(comparison, schema))


def _schema(outputs: list[tuple[str, str]]) -> pa.Schema:
    def field(name: str, unit: str) -> pa.Field:
        return pa.field(name, pa.float64(), metadata={"unit": unit})

    fields = [field("time", "s"), pa.field("recording", pa.string(), nullable=False)]
    for name, unit in outputs:
        fields += [field(f"{name}_{kind}", unit) for kind in ("measured", "before", "after")]
        fields.append(field(f"{name}_innovation", "1"))
    return pa.schema(fields)


def _table(comparison: Comparison, schema: pa.Schema) -> pa.Table:
    time, measured = comparison.recording.time, comparison.recording.measured()
    innovations = np.full_like(measured, np.nan) if comparison.innovations is None else comparison.innovations
    kinds = (measured, comparison.before.measured(), comparison.after.measured(), innovations)
    columns = [pa.array(kind[:, output], from_pandas=True) for output in range(measured.shape[1]) for kind in kinds]
    role = pa.repeat(comparison.role.upper(), len(time))
    return pa.Table.from_arrays([pa.array(time), role, *columns], schema=schema)
