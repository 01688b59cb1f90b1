"""Every effect that the project knows: one file each, listed here and nowhere else."""

from typing import Dict, Tuple

from .damping import DAMPING
from .effect import ActiveEffect, Effect, Parameter, State
from .modulus import MODULUS
from .payload import PAYLOAD

ALL: Tuple[Effect, ...] = (DAMPING, MODULUS, PAYLOAD)

BY_NAME: Dict[str, Effect] = {effect.name: effect for effect in ALL}

__all__ = ["ALL", "BY_NAME", "ActiveEffect", "Effect", "Parameter", "State"]
