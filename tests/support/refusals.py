"""What every refusal of the library has, looked at once."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tautwire.errors import ArgumentError


def refused(call: Callable[[], object], argument: str, *words: str) -> None:
    """Assert that a call names its argument, what is wrong with it, and what to give instead, in one line."""
    with pytest.raises(ArgumentError) as caught:
        call()
    error = caught.value
    assert error.where == argument
    assert error.problem and error.hint and "\n" not in str(error)
    assert not [word for word in words if word not in str(error)], str(error)
