"""The table [platform] of a robot file: a point mass, or with an inertia a rigid body."""

from __future__ import annotations

import math

from ..validation import NumberRule
from .checked_table import CheckedTable
from .schema import Platform, Point

MASS_RULE = NumberRule("the platform's mass", "kg", positive=True)
MASS_UNCERTAINTY_RULE = NumberRule("the standard deviation of the true mass", "kg", minimum=0.0, default=0.0)
INERTIA_UNCERTAINTY_RULE = NumberRule(
    "the standard deviation of each true principal moment", "kg m^2", minimum=0.0, default=0.0
)
CENTRE_UNCERTAINTY_RULE = NumberRule(
    "the standard deviation of each coordinate of the true centre of mass", "m", minimum=0.0, default=0.0
)
ADD_INERTIA = "give [platform] an inertia"
# Keys that only a rigid body has, by their table.
PLATFORM_KEYS = ("centre_of_mass", "start_orientation", "inertia_uncertainty", "centre_of_mass_uncertainty")
CABLE_KEYS = ("attachment", "attachment_uncertainty")
SENSOR_KEYS = ("orientation_noise",)

# Relative to the largest principal moment: what rounding to six digits makes of a flat body, which is at the bound.
TRIANGLE_TOLERANCE = 1e-6


def read_platform(root: CheckedTable) -> Platform:
    """Reads the platform; errors go to the table's sink."""
    table = root.table("platform")
    if table is None:
        if "platform" not in root.content:
            root.refuse("platform", "is missing", "add a table [platform] with mass and start")
        return Platform(math.nan, (math.nan, math.nan, math.nan))
    table.require_known(("mass", "start", "mass_uncertainty", "inertia", *PLATFORM_KEYS))
    mass, start = table.number("mass", MASS_RULE), table.point("start", "where the run starts")
    mass_uncertainty = table.number("mass_uncertainty", MASS_UNCERTAINTY_RULE)
    if "inertia" not in table.content:
        refuse_keys_of_rigid_bodies(table, PLATFORM_KEYS)
        return Platform(mass, start, mass_uncertainty)
    orientation = table.unit_vector("start_orientation", "the unit quaternion [w, x, y, z]", Platform.start_orientation)
    w, x, y, z = orientation
    return Platform(
        mass,
        start,
        mass_uncertainty,
        _read_inertia(table),
        table.point("centre_of_mass", "the centre of mass in the platform's frame", Platform.centre_of_mass),
        (w, x, y, z),
        table.number("inertia_uncertainty", INERTIA_UNCERTAINTY_RULE),
        table.number("centre_of_mass_uncertainty", CENTRE_UNCERTAINTY_RULE),
    )


def refuse_keys_of_rigid_bodies(table: CheckedTable, keys: tuple[str, ...]) -> None:
    """Reports each key of a table that a robot with a point mass cannot have."""
    for key in keys:
        if key in table.content:
            table.refuse(key, "is of a rigid body, and the platform is a point mass", f"{ADD_INERTIA}, or remove {key}")


def _read_inertia(table: CheckedTable) -> tuple[Point, Point, Point]:
    """The inertia, with principal moments that a body can have: positive, none above the sum of the others."""
    import numpy as np

    meaning = "the inertia about the centre of mass, in kg m^2,"
    inertia = table.symmetric_matrix("inertia", meaning)
    if not np.all(np.isfinite(inertia)):
        return inertia
    moments = np.linalg.eigvalsh(np.array(inertia)).tolist()
    listed = ", ".join(f"{moment:.6g}" for moment in moments)
    if moments[0] <= 0.0:
        problem = f"has the principal moments {listed} kg m^2, must have all above 0 kg m^2"
        table.refuse("inertia", problem, f"give {meaning} or leave it out for a point mass")
    elif moments[2] - moments[0] - moments[1] > TRIANGLE_TOLERANCE * moments[2]:
        problem = f"has the principal moments {listed} kg m^2, must have none above the sum of the others"
        table.refuse("inertia", problem, f"give {meaning} not a matrix of products or of second moments")
    return inertia
