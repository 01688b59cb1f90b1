"""The residual file of a trace: each sample of each recording beside both co-simulations, and its innovations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from tautwire_fmu.laws.rotation import Quaternion

from ..cosimulation.robot_cosimulation import CosimulationResult
from ..estimation.trace_result import Comparison, Trace
from ..provenance import Provenance
from ..recordings.quaternion_columns import rotation_vectors
from ..recordings.recording import Recording
from ..robot.schema import AXES

Array = NDArray[np.float64]

RESIDUAL_FILE = "residuals.parquet"


def write_residuals(trace: Trace, path: Path, provenance: Provenance | None = None) -> None:
    """Write the measured, both co-simulated outputs and the innovations, a group of rows for each recording."""
    outputs = [(axis, "m") for axis in AXES]
    outputs += [(f"tension_{cable}", "N") for cable in trace.robot_before.cable_numbers]
    if trace.robot_before.platform.is_rigid_body:
        outputs += [(f"rotation_{axis}", "rad") for axis in AXES]
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
    time, reference = comparison.recording.time, _reference_orientation(comparison)
    measured, before, after = (
        _outputs(each, reference) for each in (comparison.recording, comparison.before, comparison.after)
    )
    innovations = np.full_like(measured, np.nan) if comparison.innovations is None else comparison.innovations
    kinds = (measured, before, after, innovations)
    columns = [pa.array(kind[:, output], from_pandas=True) for output in range(measured.shape[1]) for kind in kinds]
    role = pa.repeat(comparison.role.upper(), len(time))
    return pa.Table.from_arrays([pa.array(time), role, *columns], schema=schema)


def _reference_orientation(comparison: Comparison) -> Quaternion | None:
    """The orientation from which rotations count: the one in which the later run begins; None for a point mass."""
    run = comparison.after
    return None if run.orientation is None else run.orientation[0].tolist()


def _outputs(outputs: Recording | CosimulationResult, reference: Quaternion | None) -> Array:
    """Positions, tensions, and rotation vectors from a reference where there is one (N, m)."""
    if reference is None or outputs.orientation is None:
        return outputs.measured()
    return np.hstack([outputs.measured(), rotation_vectors(outputs.orientation, reference)])
