"""Optimal input design: winch programs that tell effects apart."""

from .limits import default_limits
from .program import MultisinePath
from .search import EffectSeparation, Excitation, ExcitationError, ExcitationLimits, design_excitation

__all__ = [
    "EffectSeparation",
    "Excitation",
    "ExcitationError",
    "ExcitationLimits",
    "MultisinePath",
    "default_limits",
    "design_excitation",
]
