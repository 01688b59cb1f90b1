"""Static start as a function of parameters, with its derivatives where a root of equations takes a formula's place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi
import numpy as np
from casadi import SX
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ImplicitRoot:
    """Root of equations with symbolic parameters: its ``unknowns`` (k,), and their ``values`` by the parameters.

    Of ``equations`` F (m,) and a constant ``inverse`` M (k, m) of their Jacobian it is the limit of ``z <- z - M F``.
    The ``projector`` P (k, k) onto what M reaches is M times that Jacobian.
    """

    unknowns: SX
    values: SX
    equations: SX
    inverse: Array
    projector: Array

    def jacobian(self, symbols: SX) -> SX:
        """Derivatives of the unknowns by parameters (k, p), in which the unknowns are symbols.

        By the implicit function theorem

            (M F_z + 1 - P) dz/dp = -M F_p

        which takes a small part of the operations of differentiated iterations.
        """
        by_unknowns, by_symbols = (casadi.jacobian(self.equations, each) for each in (self.unknowns, symbols))
        near_identity = casadi.mtimes(SX(self.inverse), by_unknowns) + SX(np.eye(len(self.projector)) - self.projector)
        return -casadi.solve(near_identity, casadi.mtimes(SX(self.inverse), by_symbols))


@dataclass(frozen=True)
class StaticStart:
    """Numbers of the static start that depend on parameters: ``symbols`` for them (s,), and their ``expressions``.

    The latter have parameters and the unknowns of the ``roots`` as symbols.
    """

    symbols: SX
    expressions: SX
    roots: tuple[ImplicitRoot, ...]

    @property
    def values(self) -> SX:
        """The numbers by the parameters alone (s,)."""
        return at_roots([self.expressions], self.roots)[0]

    def jacobian(self, symbols: SX) -> SX:
        """Derivatives of the numbers by parameters (s, p)."""
        result = casadi.jacobian(self.expressions, symbols)
        for root in self.roots:
            by_unknowns = casadi.jacobian(self.expressions, root.unknowns)
            result += casadi.mtimes(by_unknowns, root.jacobian(symbols))
        return at_roots([result], self.roots)[0]


def at_roots(expressions: Sequence[SX], roots: Sequence[ImplicitRoot]) -> list[SX]:
    """Expressions with the values of unknowns in their place."""
    if not roots:
        return list(expressions)
    unknowns, values = ([getattr(root, name) for root in roots] for name in ("unknowns", "values"))
    substituted: list[SX] = casadi.substitute(list(expressions), unknowns, values)
    return substituted
