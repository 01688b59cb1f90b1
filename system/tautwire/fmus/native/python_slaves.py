"""Python slaves of components, from which native FMUs have their variables and start values."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tautwire_fmu import slaves
from tautwire_fmu.slave import Slave


def python_slave(kind: str, base: str, data: Mapping[str, Any]) -> Slave:
    """The Python slave of a component's resource: its variables, and the values that they start with."""
    with tempfile.TemporaryDirectory(prefix="tautwire-build-") as resources:
        (Path(resources) / f"{kind}.json").write_text(json.dumps(data), encoding="utf-8")
        slave: Slave = getattr(slaves, base)(instance_name=data["model_name"], resources=resources)
    return slave
