"""Every effect that the project knows: one file each, listed here and nowhere else."""

from typing import Dict, Tuple

from .anchor import ANCHOR
from .attachment import ATTACHMENT
from .centre_of_mass import CENTRE_OF_MASS
from .creep import CREEP
from .damping import DAMPING
from .drag import DRAG
from .drum import DRUM
from .effect import ActiveEffect, Effect, Parameter, State
from .frame import FRAME
from .friction import FRICTION
from .hanging_load import HANGING_LOAD
from .hysteresis import HYSTERESIS
from .inertia import INERTIA
from .modulus import MODULUS
from .payload import PAYLOAD
from .pulley import PULLEY
from .relaxation import RELAXATION
from .rotational_drag import ROTATIONAL_DRAG
from .sag import SAG
from .sensor_delay import SENSOR_DELAY
from .sensor_gain import SENSOR_GAIN
from .sensor_offset import SENSOR_OFFSET
from .slack import SLACK
from .stiffening import STIFFENING
from .thermal import THERMAL
from .transverse_damping import TRANSVERSE_DAMPING

ALL: Tuple[Effect, ...] = (
    DAMPING,
    MODULUS,
    RELAXATION,
    HYSTERESIS,
    CREEP,
    THERMAL,
    SAG,
    PULLEY,
    ANCHOR,
    DRUM,
    FRICTION,
    PAYLOAD,
    DRAG,
    SLACK,
    SENSOR_DELAY,
    SENSOR_GAIN,
    SENSOR_OFFSET,
    CENTRE_OF_MASS,
    ATTACHMENT,
    INERTIA,
    ROTATIONAL_DRAG,
    TRANSVERSE_DAMPING,
)

# Effects outside the list: a trace that selects one has discovered it.
UNLISTED: Tuple[Effect, ...] = (FRAME, HANGING_LOAD, STIFFENING)

BY_NAME: Dict[str, Effect] = {effect.name: effect for effect in (*ALL, *UNLISTED)}

__all__ = ["ALL", "BY_NAME", "UNLISTED", "ActiveEffect", "Effect", "Parameter", "State"]
