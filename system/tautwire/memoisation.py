"""Memoisation of functions of a robot or a recording, which are asked for the same again and again."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, TypeVar

Result = TypeVar("Result")


def memoised(max_results: int) -> Callable[[Callable[..., Result]], Callable[..., Result]]:
    """Decorator that keeps the latest results of a pure function, whose results nobody changes.

    Arguments that cannot be hashed, as a robot whose fields somebody made lists, are computed with each time.
    """

    def decorate(function: Callable[..., Result]) -> Callable[..., Result]:
        kept = lru_cache(max_results)(function)

        @wraps(function)
        def call(*arguments: Any) -> Result:
            try:
                hash(arguments)
            except TypeError:
                return function(*arguments)
            return kept(*arguments)

        return call

    return decorate
