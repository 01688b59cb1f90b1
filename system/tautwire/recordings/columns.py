"""Recordings as columns of numbers in memory, independent of the file format."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

from .header import Header
from .rules import Row


@dataclass(frozen=True)
class ColumnTable:
    """The known columns of a columnar file or a frame, in memory."""

    file: str
    header: Header
    columns: Mapping[str, NDArray[np.float64]]

    def numbers(self) -> Mapping[str, NDArray[np.float64]]:
        """The known columns, each of shape (N,), NaN where a cell is null."""
        return self.columns

    def rows(self) -> Iterator[Row]:
        """The samples, counted from 1, each with the file and its number, as a CSV file would have them."""
        columns = [self.columns.get(name, repeat(math.nan)) for name in self.header.names]
        for number, row in enumerate(zip(*columns, strict=False), 1):
            yield Row(f"{self.file}: row {number}", number, [repr(float(value)) for value in row])
