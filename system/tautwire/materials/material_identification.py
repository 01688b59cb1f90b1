"""Tests a constant modulus and damping against a dynamic test, and identifies what the rope has besides."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

from scipy.stats import chi2

from ..errors import InputError
from .material_table import MaterialRow, MaterialTable
from .material_verdict import (
    ErrorAssumption,
    Estimate,
    EvaluatedModel,
    FitOutcome,
    IdentifiedEffect,
    MaterialOptions,
    MaterialVerdict,
    RmsErrors,
    Role,
    StaticCheck,
    VerdictName,
    evaluate_fit,
    evaluate_model,
    fit_errors,
    noise_floor,
    prediction_errors,
)
from .model_selection import (
    CONSTANT_PAIR,
    LINEAR_VISCOELASTIC,
    ModelSelection,
    best_linear_fit,
    cross_validate,
    select_model,
)
from .modulus_fit import MaterialFit, fit_structure, relaxation_floor
from .modulus_intervals import profile_chi_squared
from .modulus_observations import ModulusObservations, observations_from_table
from .table_consistency import consistency_checks
from .viscoelastic_model import Material, ModelStructure

ASSUMED_SHARED_VARIANCE, TWO_SIGMA_COVERAGE = 0.5, 2.0

# Real residuals are never quite white: a root mean square up to this many standard deviations is adequate.
MAX_ADEQUATE_RMS = 1.5
# Relative difference up to which a frequency denotes a row.
FREQUENCY_TOLERANCE = 1e-3
Progress = Callable[[str, float], None]


def error_assumptions(
    table: MaterialTable,
    pair: tuple[str, str],
    options: MaterialOptions,
    structures: Mapping[Role, ModelStructure],
) -> tuple[ErrorAssumption, ...]:
    """Goodness of fit of each model under each reading of the errors, that in use first."""
    return tuple(
        ErrorAssumption(label, {role: _fit_outcome(observations, each) for role, each in structures.items()})
        for label, observations in _error_readings(table, pair, options)
    )


def _fit_outcome(observations: ModulusObservations, structure: ModelStructure) -> FitOutcome:
    fit = fit_structure(observations, structure)
    return FitOutcome(fit.chi_squared, fit.degrees_of_freedom, fit.p_value)


def _error_readings(
    table: MaterialTable, pair: tuple[str, str], options: MaterialOptions
) -> Iterator[tuple[str, ModulusObservations]]:
    def read(
        read_pair: tuple[str, str] = pair,
        shared: float = options.shared_variance,
        coverage: float = options.coverage_factor,
    ) -> ModulusObservations:
        return observations_from_table(table, read_pair, shared, coverage)

    yield "as fitted", read()
    for other in table.modulus_pairs():
        if other != pair:
            yield f"from {other[0]} and {other[1]}", read(other)
    for assumed_share in (0.0, ASSUMED_SHARED_VARIANCE):
        if assumed_share != options.shared_variance:
            yield f"{assumed_share:.0%} of each variance common to all rows", read(shared=assumed_share)
    if options.coverage_factor != TWO_SIGMA_COVERAGE:
        yield "uncertainties are two standard deviations", read(coverage=TWO_SIGMA_COVERAGE)
    if table.static_rows:
        yield "static rows fitted too", read().with_static_rows(table, options.coverage_factor)


def pair_of_row(table: MaterialTable, frequency: float) -> Material:
    """The constant pair of one row, as written there or computed; raises InputError where there is none."""
    matching_rows = [row for row in table.rows if math.isclose(row.frequency, frequency, rel_tol=FREQUENCY_TOLERANCE)]
    if not matching_rows:
        listed = ", ".join(f"{row.frequency:g}" for row in table.rows)
        raise InputError("--at", f"{frequency:g} Hz is no row of {table.path}", f"give one of {listed}")
    row = matching_rows[0]
    observations = observations_from_table(MaterialTable(table.path, (row,), ()), table.modulus_pairs()[0])
    return Material(
        modulus=_value_or_default(row, "storage_modulus", float(observations.storage[0])),
        damping=_value_or_default(row, "damping", float(observations.damping[0])),
    )


def trace_material(
    table: MaterialTable,
    declared: Material | None = None,
    options: MaterialOptions | None = None,
    progress: Progress = lambda what, done: None,
) -> MaterialVerdict:
    """Identify a rope from a table; ``declared`` are the constants in use, ``progress`` a progress callback."""
    start_time = time.perf_counter()
    options = options or MaterialOptions()
    pair = options.pair or table.modulus_pairs()[0]
    observations = observations_from_table(table, pair, options.shared_variance, options.coverage_factor)
    selection = select_model(observations, options.significance_level, progress)
    models = _evaluated_models(table, observations, selection, declared, options, progress)
    by_role = {model.role: model for model in reversed(models)}
    reference, chosen = models[0], by_role["chosen"]
    effects = _identified_effects(selection, chosen, declared, options.significance_level)
    verdict_name = _decide(reference, chosen, effects, options.significance_level)
    effects_identified = verdict_name == "effects"
    accepted = chosen if effects_identified else reference
    progress("fitting under other error assumptions", 0.0)
    return MaterialVerdict(
        verdict=verdict_name,
        table=table,
        pair=pair,
        options=options,
        observations=observations,
        models=tuple(models),
        effects=effects if effects_identified else (),
        confusable_effects=_confusable_effects(selection, options.significance_level) if effects_identified else (),
        error_before=_errors_by_use(observations, reference),
        error_after=_errors_by_use(observations, accepted),
        noise_floor=noise_floor(observations),
        adequate_before=reference.p_value >= options.significance_level,
        adequate_after=accepted.p_value >= options.significance_level,
        consistency_checks=consistency_checks(table),
        error_assumptions=error_assumptions(table, pair, options, _compared_structures(selection)),
        static_checks=tuple(_static_checks(table, by_role, options.coverage_factor)),
        relaxation_floor=relaxation_floor(observations),
        seconds=time.perf_counter() - start_time,
    )


def _value_or_default(row: MaterialRow, column: str, default: float) -> float:
    quantity = row.quantities.get(column)
    return default if quantity is None else quantity.value


def _compared_structures(selection: ModelSelection) -> dict[Role, ModelStructure]:
    return {
        "constant": selection.best_fits[CONSTANT_PAIR].structure,
        "relaxation": selection.best_fits[LINEAR_VISCOELASTIC].structure,
        "chosen": selection.fit.structure,
    }


def _evaluated_models(
    table: MaterialTable,
    observations: ModulusObservations,
    selection: ModelSelection,
    declared: Material | None,
    options: MaterialOptions,
    progress: Progress,
) -> list[EvaluatedModel]:
    """Evaluate all models that a report compares, the declared one first."""
    fits: list[tuple[Role, MaterialFit]] = [
        ("constant", selection.best_fits[CONSTANT_PAIR]),
        ("relaxation", selection.best_fits[LINEAR_VISCOELASTIC]),
        ("chosen", selection.fit),
        *(("rival", selection.best_fits[rival]) for rival in selection.confusable_models(options.significance_level)),
    ]
    models = [evaluate_model(observations, "declared", _structure_of(declared).label, declared)] if declared else []
    for index, (role, fit) in enumerate(fits):
        progress(f"leaving out rows: {fit.structure.label}", index / len(fits))
        models.append(evaluate_fit(observations, role, fit, declared, cross_validate(observations, fit.structure)))
    progress("fitting the form of a robot file", 0.0)
    robot_fit = (
        best_linear_fit(observations.with_static_rows(table, options.coverage_factor))
        if table.static_rows
        else selection.best_fits[LINEAR_VISCOELASTIC]
    )
    return [*models, evaluate_fit(observations, "robot", robot_fit, declared)]


def _structure_of(declared: Material) -> ModelStructure:
    return replace(CONSTANT_PAIR, branches=len(declared.branches))


def _identified_effects(
    selection: ModelSelection, chosen: EvaluatedModel, declared: Material | None, significance_level: float
) -> tuple[IdentifiedEffect, ...]:
    """Terms that a constant pair lacks, and constants that the declared rope has wrong, by falling likelihood ratio.

    Where the declared rope does not fit, its relaxation is identified anew with the rest.
    """
    effects = [
        IdentifiedEffect(effect, _parameters_of(chosen, effect), selection.evidence(effect))
        for effect in selection.chosen.effects - CONSTANT_PAIR.effects
    ]
    constants = [("modulus", declared.modulus), ("damping", declared.damping)] if declared else []
    for parameter_index, (name, value) in enumerate(constants):
        chi_squared = profile_chi_squared(selection.fit, parameter_index, value)
        evidence = 0.5 * (chi_squared - selection.fit.chi_squared)
        if chi2.sf(2.0 * evidence, 1) < significance_level:
            effects.append(IdentifiedEffect(name, _parameters_of(chosen, name), evidence))
    return tuple(sorted(effects, key=lambda effect: -effect.log_likelihood_ratio))


def _confusable_effects(selection: ModelSelection, significance_level: float) -> tuple[tuple[str, ...], ...]:
    """Confusable models by the names of their effects, each set once, without that of the chosen one."""
    effect_sets = dict.fromkeys(rival.effects for rival in selection.confusable_models(significance_level))
    return tuple(tuple(sorted(effects)) for effects in effect_sets if effects != selection.chosen.effects)


def _parameters_of(model: EvaluatedModel, effect: str) -> dict[str, Estimate]:
    return {estimate.name: estimate for estimate in model.estimates if estimate.effect == effect}


def _decide(
    reference: EvaluatedModel, chosen: EvaluatedModel, effects: tuple[IdentifiedEffect, ...], significance_level: float
) -> VerdictName:
    if not effects or (
        reference.role == "declared" and reference.p_value >= significance_level and not _exceeds(effects, reference)
    ):
        return "none" if reference.p_value >= significance_level else "unexplained"
    adequate = chosen.p_value >= significance_level or _rms_residual(chosen) <= MAX_ADEQUATE_RMS
    return "effects" if adequate else "unexplained"


def _exceeds(effects: tuple[IdentifiedEffect, ...], declared: EvaluatedModel) -> bool:
    """Whether the effects are more than other values of the declared constants."""
    declared_effects = {"modulus", *_structure_of(declared.material).effects}
    return any(effect.name not in declared_effects for effect in effects)


def _rms_residual(model: EvaluatedModel) -> float:
    measurement_count = len(model.storage_residuals) + len(model.damping_residuals)
    return math.sqrt(model.chi_squared / measurement_count)


def _errors_by_use(observations: ModulusObservations, model: EvaluatedModel) -> dict[str, RmsErrors]:
    return {"fit": fit_errors(observations, model), "check": prediction_errors(observations, model)}


def _static_checks(
    table: MaterialTable, models: dict[Role, EvaluatedModel], coverage_factor: float
) -> Iterator[StaticCheck]:
    """Check the table's static rows against the long-term moduli of models that were not fitted to them."""
    for row in table.static_rows:
        measured = row.quantities["storage_modulus"]
        for role in ("constant", "relaxation", "chosen"):
            predicted = models[role].estimates[0]
            yield StaticCheck(role, measured.value, float(measured.uncertainty or 0.0) / coverage_factor, predicted)
