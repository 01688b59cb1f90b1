"""What the design of a controller raises; each error carries its values."""

from __future__ import annotations

from ..errors import InputError


class MarginError(InputError):
    """No controller of a design keeps its margin; ``asked`` and the best ``reached`` are disk margins."""

    def __init__(self, where: str, asked: float, reached: float, mend: str) -> None:
        super().__init__(where, f"a disk margin of {asked:g} cannot be kept, {reached:.3g} is the best", mend)
        self.asked = asked
        self.reached = reached
        self.args = (where, asked, reached, mend)


class StretchError(InputError):
    """No winch speeds make the elastic model follow a path; ``time`` in s is where the search for them ended."""

    def __init__(self, where: str, time: float, mend: str) -> None:
        super().__init__(where, f"no winch speeds were found that follow the path at {time:g} s", mend)
        self.time = time
        self.args = (where, time, mend)
