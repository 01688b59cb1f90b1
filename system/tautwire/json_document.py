"""JSON documents as all commands write them: null where a number is not finite."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def json_value(value: Any) -> Any:
    """The value with null for each number that is not finite and lists for tuples and arrays, also inside of others."""
    if hasattr(value, "tolist"):  # an array or a number of NumPy
        value = value.tolist()
    if isinstance(value, Mapping):
        return {name: json_value(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [json_value(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_json(path: Path, document: Any) -> None:
    """Writes a document of plain values, with a line break at the end."""
    path.write_text(json.dumps(json_value(document), indent=1, allow_nan=False) + "\n", encoding="utf-8")
