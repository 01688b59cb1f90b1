"""What a dynamic test says of a rope: from a table of moduli over frequency to the rope of a robot file."""

from .robot_material import RobotMaterial, robot_material, with_material
from .table import PAPER_PAIR_AT, PAPER_TABLE, MaterialTable, read_material_table
from .tracing import pair_of_row, trace_material
from .verdict import MaterialVerdict, Options

__all__ = [
    "PAPER_PAIR_AT",
    "PAPER_TABLE",
    "MaterialTable",
    "MaterialVerdict",
    "Options",
    "RobotMaterial",
    "pair_of_row",
    "read_material_table",
    "robot_material",
    "trace_material",
    "with_material",
]
