"""How uncertain parameters move the static start of a platform whose orientation follows from its equilibrium."""

from __future__ import annotations

import casadi
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from ..memoisation import memoised
from .cable_routes import cable_routes
from .measured_start import with_true_start
from .schema import Robot
from .static_equilibrium import static_tensions
from .static_start import StaticStart
from .symbolic_equations import CASADI_MATHEMATICS
from .symbolic_statics import symbolic_statics
from .uncertain_parameters import perturbed_robot, uncertain_parameters

Array = NDArray[np.float64]


@memoised(max_results=32)
def equilibrium_slopes(robot: Robot) -> Array:
    """Slopes of the start's rotation (rad) and unstrained lengths (m) by the uncertain parameters (3 + n, c).

    Parameters count in standard deviations. An unstrained length is the one at the declared tension ``T_0``

        l (1 - (T - T_0) / (E A))

    with the length ``l`` and tension ``T`` in equilibrium.
    """
    nominal, parameters = with_true_start(robot), uncertain_parameters(robot)
    symbols = SX.sym("uncertain", len(parameters))
    perturbed = perturbed_robot(nominal, parameters, casadi.vertsplit(symbols))
    statics = symbolic_statics(nominal, perturbed, nominal.platform.start_orientation, CASADI_MATHEMATICS)
    start, orientation = nominal.platform.start, statics.orientation
    lengths = [route.length for route in cable_routes(CASADI_MATHEMATICS, perturbed, start, orientation)]
    unstrained = [
        length * (1.0 - (tension - declared) / (cable.modulus * cable.area))
        for length, tension, declared, cable in zip(
            lengths, statics.tensions, static_tensions(nominal), nominal.cables, strict=True
        )
    ]
    slopes = StaticStart(SX(0, 1), casadi.vertcat(statics.rotation, *unstrained), statics.roots).jacobian(symbols)
    result: Array = np.array(casadi.Function("slopes", [symbols], [slopes])(0.0))
    return result
