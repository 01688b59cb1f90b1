"""Winch programs that tell effects apart."""

from .limits import default_limits
from .program import MultisinePath
from .search import Excitation, ExcitationError, Limits, Pair, excite

__all__ = ["Excitation", "ExcitationError", "Limits", "MultisinePath", "Pair", "default_limits", "excite"]
