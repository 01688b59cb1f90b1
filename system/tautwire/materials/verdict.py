"""What a dynamic test says about a rope: values only, for reports to show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .consistency import Check
from .leave_out import LeaveOut
from .modulus import Material
from .observations import Observations
from .table import MaterialTable

Array = NDArray[np.float64]
VerdictName = Literal["effects", "none", "unexplained"]
Role = Literal["declared", "constant", "relaxation", "chosen", "rival", "robot"]


@dataclass(frozen=True)
class Options:
    """How a table is read and judged.

    ``pair`` are the two columns that are fitted, None for the preferred ones; ``shared`` the share of variance that all
    rows have in common; uncertainties are ``coverage`` standard deviations; ``alpha`` the rate of false alarms.
    """

    pair: tuple[str, str] | None = None
    shared: float = 0.0
    coverage: float = 1.0
    alpha: float = 0.01


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval, in SI units; a side is open where only a bound of the model ends it.

    ``declared`` is the constant in use so far, None where there is none.
    """

    effect: str
    name: str
    unit: str
    value: float
    low: float
    high: float
    low_is_open: bool
    high_is_open: bool
    declared: float | None = None


@dataclass(frozen=True)
class FoundEffect:
    """A term that earned its place; ``evidence`` is the natural log of its likelihood ratio."""

    name: str
    parameters: Mapping[str, Estimate]
    evidence: float


@dataclass(frozen=True)
class Model:
    """One model beside the table.

    ``storage_sigmas`` and ``damping_sigmas``, each (N,), are model less measured in standard deviations of the table;
    ``freedom`` the numbers less free parameters. ``estimates`` is empty for a declared pair; ``leave_out`` is None for
    one, and where it was not asked for.
    """

    role: Role
    label: str
    material: Material
    estimates: tuple[Estimate, ...]
    chi_squared: float
    freedom: int
    p_value: float
    bic: float
    storage_sigmas: Array
    damping_sigmas: Array
    leave_out: LeaveOut | None = None


@dataclass(frozen=True)
class Assumption:
    """Chi-squared and p value of some models, by role, where the table's errors are read in another way."""

    label: str
    outcomes: Mapping[Role, tuple[float, int, float]]


@dataclass(frozen=True)
class StaticCheck:
    """A static test, which no model was fitted to, beside the long-term modulus that a model predicts; all in Pa."""

    role: Role
    measured: float
    uncertainty: float
    predicted: Estimate


@dataclass(frozen=True)
class Errors:
    """Root mean squares over the rows: storage modulus in Pa, damping in Pa s."""

    storage_modulus_rms: float
    damping_rms: float


@dataclass(frozen=True)
class MaterialVerdict:
    """The answer to: does one pair of modulus and damping describe this rope, and if not, what does.

    ``models`` has the declared pair, where there is one, first. ``floor`` is the least chi-squared that damping and any
    number of branches leave. ``error_before`` and ``error_after`` are of the declared pair (else the best constant one)
    and of the chosen model: ``fit`` for rows that were fitted, ``check`` for each row predicted from the others.
    """

    verdict: VerdictName
    table: MaterialTable
    pair: tuple[str, str]
    options: Options
    seen: Observations
    models: tuple[Model, ...]
    effects: tuple[FoundEffect, ...]
    also_possible: tuple[tuple[str, ...], ...]
    error_before: Mapping[str, Errors]
    error_after: Mapping[str, Errors]
    noise_floor: Errors
    noise_before: bool
    noise_after: bool
    checks: tuple[Check, ...]
    assumptions: tuple[Assumption, ...]
    static_checks: tuple[StaticCheck, ...]
    floor: float
    seconds: float

    def model(self, role: Role) -> Model:
        """The first model of a role; raises KeyError where there is none."""
        for model in self.models:
            if model.role == role:
                return model
        raise KeyError(role)

    @property
    def before(self) -> Model:
        """The declared pair, or where none is declared the best constant one."""
        return self.model("declared" if self.models[0].role == "declared" else "constant")

    @property
    def after(self) -> Model:
        """The model that the table asks for."""
        return self.model("chosen")
