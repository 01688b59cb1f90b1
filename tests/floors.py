"""The lowest versions that the project declares, as constraints for pip: ``python -m tests.floors``."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from packaging.requirements import Requirement

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

EXTRAS = ("mat", "mdf", "ros")
PROJECT = Path(__file__).parent.parent / "pyproject.toml"


def floors() -> Iterator[str]:
    """A line for each dependency of the package and of ``EXTRAS``: the lowest version that it may have."""
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    extras = [each for extra in EXTRAS for each in project["optional-dependencies"][extra]]
    for requirement in map(Requirement, [*project["dependencies"], *extras]):
        (lowest,) = [each.version for each in requirement.specifier if each.operator in (">=", "==")]
        yield f"{requirement.name}=={lowest}"


if __name__ == "__main__":
    print("\n".join(floors()))
