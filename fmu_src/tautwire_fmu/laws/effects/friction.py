"""Friction of the exit pulley, between platform and load cell, by the capstan equation."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter

QUARTER_TURN = 1.5707963267948966


class Values(NamedTuple):
    """Coefficients of friction by where the tension law holds, angle of wrap, and speed below which friction fades."""

    coefficient: Any
    coefficient_at_cell: Any
    wrap: Any
    smoothing: Any


def transmission(m: Mathematics, values: Values, motion: Any) -> Tuple[Any, Any]:
    """Logarithms of the tensions at platform and load cell over that of the law: the cell has more, reeling in.

    ``ln(T_cell / T_platform) = (mu + mu_cell) wrap tanh(V / v_s)``. By ``mu`` the law gives the tension of the free
    span, which pulls the platform; by ``mu_cell`` it gives that at the load cell, and friction acts on the platform.
    """
    log_ratio_per_coefficient = values.wrap * m.tanh(motion.rope_speed / values.smoothing)
    return -values.coefficient_at_cell * log_ratio_per_coefficient, values.coefficient * log_ratio_per_coefficient


FRICTION = Effect(
    name="friction",
    component="cable",
    description="friction of the exit pulley, between platform and load cell",
    parameters=(
        Parameter(
            name="coefficient",
            unit="1",
            description="coefficient of friction, where the law gives the tension of the free span",
            minimum=0.0,
            maximum=1.0,
            neutral=0.0,
            start=0.02,
        ),
        Parameter(
            name="coefficient_at_cell",
            unit="1",
            description="coefficient of friction, where the law gives the tension at the load cell",
            minimum=0.0,
            maximum=1.0,
            neutral=0.0,
            start=0.02,
        ),
        Parameter(
            name="wrap",
            unit="rad",
            description="angle over which the rope lies on the pulley",
            minimum=0.0,
            maximum=20.0,
            neutral=QUARTER_TURN,
            start=QUARTER_TURN,
        ),
        Parameter(
            name="smoothing",
            unit="m/s",
            description="rope speed below which friction fades to none at rest",
            minimum=1e-5,
            maximum=1.0,
            neutral=0.005,
            start=0.005,
            multistart_values=(0.005, 0.05),
        ),
    ),
    values=Values,
    forms=(("coefficient", "smoothing"), ("coefficient_at_cell", "smoothing")),
    transmission=transmission,
    source="Euler (1762), Eytelwein (1808): the capstan equation",
)
