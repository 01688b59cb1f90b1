"""Identification of a rope's viscoelastic constants from a dynamic test, for use in a robot file."""

from .material_identification import pair_of_row, trace_material
from .material_table import PAPER_PAIR_FREQUENCY, PAPER_TABLE, MaterialTable, read_material_table
from .material_verdict import MaterialOptions, MaterialVerdict
from .robot_material import RobotMaterial, robot_material, with_material

__all__ = [
    "PAPER_PAIR_FREQUENCY",
    "PAPER_TABLE",
    "MaterialOptions",
    "MaterialTable",
    "MaterialVerdict",
    "RobotMaterial",
    "pair_of_row",
    "read_material_table",
    "robot_material",
    "trace_material",
    "with_material",
]
