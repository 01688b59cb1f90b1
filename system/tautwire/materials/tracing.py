"""Judges the constant pair of modulus and damping by a dynamic test, and finds what the rope has besides."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator

from scipy.stats import chi2

from ..errors import InputError
from .assumptions import assumptions
from .consistency import checks
from .fit import MaterialFit, relaxation_floor
from .leave_out import leave_out
from .models import declared_model, errors, fitted_model, noise_floor, predicted_errors
from .modulus import Material
from .observations import Observations, observations
from .profile import chi_squared_at
from .selection import CONSTANT, LINEAR, Selection, best_linear, select
from .table import MaterialRow, MaterialTable
from .terms import Terms
from .verdict import Errors, Estimate, FoundEffect, MaterialVerdict, Model, Options, Role, StaticCheck, VerdictName

# Real residuals are never quite white: up to so many standard deviations, root mean square, are let pass.
MATERIAL_RMS = 1.5
# A row is meant by a frequency that is so near.
SAME_FREQUENCY = 1e-3

Tell = Callable[[str, float], None]


def pair_of_row(table: MaterialTable, frequency: float) -> Material:
    """The constant pair that one row gives, as written there or worked out; raises InputError where there is none."""
    near = [row for row in table.rows if math.isclose(row.frequency, frequency, rel_tol=SAME_FREQUENCY)]
    if not near:
        listed = ", ".join(f"{row.frequency:g}" for row in table.rows)
        raise InputError("--at", f"{frequency:g} Hz is no row of {table.path}", f"give one of {listed}")
    row = near[0]
    seen = observations(MaterialTable(table.path, (row,), ()), table.pairs()[0])
    return Material(
        modulus=_written(row, "storage_modulus", float(seen.storage[0])),
        damping=_written(row, "damping", float(seen.damping[0])),
    )


def trace_material(
    table: MaterialTable,
    declared: Material | None = None,
    options: Options | None = None,
    tell: Tell = lambda what, done: None,
) -> MaterialVerdict:
    """The verdict on a table; ``declared`` is the constant pair in use, ``tell`` hears of the progress."""
    began = time.perf_counter()
    options = options or Options()
    pair = options.pair or table.pairs()[0]
    seen = observations(table, pair, options.shared, options.coverage)
    found = select(seen, options.alpha, tell)
    models = _models(table, seen, found, declared, options.alpha, tell)
    by_role = {model.role: model for model in reversed(models)}
    before, after = models[0], by_role["chosen"]
    effects = _effects(found, after, declared, options.alpha)
    name = _verdict(before, after, effects, options.alpha)
    named = name == "effects"
    tell("reading the errors in other ways", 0.0)
    return MaterialVerdict(
        verdict=name,
        table=table,
        pair=pair,
        options=options,
        seen=seen,
        models=tuple(models),
        effects=effects if named else (),
        also_possible=_also_possible(found, options.alpha) if named else (),
        error_before=_errors(seen, before),
        error_after=_errors(seen, after if named else before),
        noise_floor=noise_floor(seen),
        noise_before=before.p_value >= options.alpha,
        noise_after=(after if named else before).p_value >= options.alpha,
        checks=checks(table),
        assumptions=assumptions(table, pair, options.shared, options.coverage, _compared(found)),
        static_checks=tuple(_static_checks(table, by_role)),
        floor=relaxation_floor(seen),
        seconds=time.perf_counter() - began,
    )


def _written(row: MaterialRow, column: str, otherwise: float) -> float:
    quantity = row.quantities.get(column)
    return otherwise if quantity is None else quantity.value


def _compared(found: Selection) -> dict[Role, Terms]:
    return {
        "constant": found.best[CONSTANT].terms,
        "relaxation": found.best[LINEAR].terms,
        "chosen": found.fit.terms,
    }


def _models(
    table: MaterialTable,
    seen: Observations,
    found: Selection,
    declared: Material | None,
    alpha: float,
    tell: Tell,
) -> list[Model]:
    """All models that a report compares, the declared pair first."""
    fits: list[tuple[Role, MaterialFit]] = [
        ("constant", found.best[CONSTANT]),
        ("relaxation", found.best[LINEAR]),
        ("chosen", found.fit),
        *(("rival", found.best[rival]) for rival in found.rivals(alpha)),
    ]
    models = [declared_model(seen, declared)] if declared else []
    for place, (role, fit) in enumerate(fits):
        tell(f"leaving out rows: {fit.terms.label}", place / len(fits))
        models.append(fitted_model(seen, role, fit, declared, leave_out(seen, fit.terms)))
    tell("fitting what a robot file can hold", 0.0)
    robot = best_linear(seen.with_static(table)) if table.static else found.best[LINEAR]
    return [*models, fitted_model(seen, "robot", robot, declared)]


def _effects(found: Selection, chosen: Model, declared: Material | None, alpha: float) -> tuple[FoundEffect, ...]:
    """The terms that the declared pair lacks or has wrong, the most evident first."""
    effects = [
        FoundEffect(effect, _parameters(chosen, effect), found.evidence(effect))
        for effect in found.chosen.effects - CONSTANT.effects
    ]
    constants = [("modulus", declared.modulus), ("damping", declared.damping)] if declared else []
    for index, (name, value) in enumerate(constants):
        left = chi_squared_at(found.fit, index, value)
        evidence = 0.5 * (left - found.fit.chi_squared)
        if chi2.sf(2.0 * evidence, 1) < alpha:
            effects.append(FoundEffect(name, _parameters(chosen, name), evidence))
    return tuple(sorted(effects, key=lambda effect: -effect.evidence))


def _also_possible(found: Selection, alpha: float) -> tuple[tuple[str, ...], ...]:
    """The rivals by the names of their effects, each set once, those of the chosen one left out."""
    sets = dict.fromkeys(rival.effects for rival in found.rivals(alpha))
    return tuple(tuple(sorted(effects)) for effects in sets if effects != found.chosen.effects)


def _parameters(model: Model, effect: str) -> dict[str, Estimate]:
    return {estimate.name: estimate for estimate in model.estimates if estimate.effect == effect}


def _verdict(before: Model, after: Model, effects: tuple[FoundEffect, ...], alpha: float) -> VerdictName:
    if not effects or (before.role == "declared" and before.p_value >= alpha and not _adds(effects)):
        return "none" if before.p_value >= alpha else "unexplained"
    adequate = after.p_value >= alpha or _rms_sigma(after) <= MATERIAL_RMS
    return "effects" if adequate else "unexplained"


def _adds(effects: tuple[FoundEffect, ...]) -> bool:
    """Whether there is more than other values of the constant pair."""
    return any(effect.name not in ("modulus", "damping") for effect in effects)


def _rms_sigma(model: Model) -> float:
    numbers = len(model.storage_sigmas) + len(model.damping_sigmas)
    return math.sqrt(model.chi_squared / numbers)


def _errors(seen: Observations, model: Model) -> dict[str, Errors]:
    return {"fit": errors(seen, model), "check": predicted_errors(seen, model)}


def _static_checks(table: MaterialTable, models: dict[Role, Model]) -> Iterator[StaticCheck]:
    """The table's static rows beside the long-term moduli of the models that did not see them."""
    for row in table.static:
        measured = row.quantities["storage_modulus"]
        for role in ("constant", "relaxation", "chosen"):
            predicted = models[role].estimates[0]
            yield StaticCheck(role, measured.value, float(measured.uncertainty or 0.0), predicted)
