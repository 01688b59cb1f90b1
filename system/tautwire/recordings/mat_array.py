"""Arrays in MATLAB files as their headers describe them."""

from dataclasses import dataclass

# Beyond any recording that can be read: 12 columns of as many samples as are read.
MAX_BYTES = 2**31
MAX_ARRAYS = 100_000
MAX_DEPTH = 20

_TABLES = ("table", "timetable", "eventtable", "timeseries", "tscollection")


@dataclass(frozen=True)
class MatArray:
    """An array of numbers: its ``path`` (``log.time``), its ``shape`` in MATLAB, and whether it is complex.

    Another array, such as text or a cell array, has its ``class_name``.
    """

    path: str
    shape: tuple[int, ...]
    is_complex: bool = False
    class_name: str = ""

    @property
    def is_numeric(self) -> bool:
        """Whether it is an array of real or complex numbers."""
        return not self.class_name

    @property
    def is_table(self) -> bool:
        """Whether it is an object of MATLAB that holds signals in a way that only MATLAB reads."""
        return self.class_name in _TABLES or self.class_name.startswith("Simulink.")


class MatFormatError(Exception):
    """The content of a MATLAB file is not valid, or larger than what is read."""
