"""The verdict on a rope: on the paper's measured table, and on tables whose answer is known."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tautwire.errors import ArgumentError, InputError
from tautwire.materials import (
    PAPER_PAIR_FREQUENCY,
    PAPER_TABLE,
    MaterialVerdict,
    pair_of_row,
    read_material_table,
    robot_material,
    trace_material,
    with_material,
)
from tautwire.materials.material_files import material_document, material_figure, write_material
from tautwire.materials.material_report import verdict_notes, verdict_sentence
from tautwire.materials.material_table import MaterialRow
from tautwire.materials.material_verdict import MaterialOptions
from tautwire.materials.robot_material import declared_material
from tautwire.materials.viscoelastic_model import Material, MaxwellBranch
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import EffectSetting
from tests.support.materials import CONSTANT, observed, written
from tests.support.robots import example

# Table 1 as printed: Hz, GPa, GPa, degrees, degrees.
ROWS = np.array(
    [
        [0.1, 121.4, 2.8, 6.8, 2.3],
        [1.0, 138.5, 3.3, 7.5, 2.8],
        [2.0, 137.1, 3.3, 11.0, 2.8],
        [5.0, 135.9, 3.1, 14.1, 2.8],
        [10.0, 136.5, 3.2, 17.6, 2.8],
        [20.0, 137.7, 3.3, 23.5, 2.8],
    ]
)
FREQUENCY = np.geomspace(0.1, 20.0, 8)


@pytest.fixture(scope="module")
def measured() -> MaterialVerdict:
    table = read_material_table(PAPER_TABLE)
    return trace_material(table, pair_of_row(table, PAPER_PAIR_FREQUENCY))


def chi_squared(storage: float, viscous: float) -> float:
    """Of a constant pair in GPa and GPa s, row by row along and across the measured modulus."""
    total = 0.0
    for frequency, size, size_sigma, phase, phase_sigma in ROWS:
        turn = np.exp(-1j * np.radians(phase))
        off = (storage + 2j * np.pi * frequency * viscous) * turn - size
        total += (off.real / size_sigma) ** 2 + (off.imag / (size * np.radians(phase_sigma))) ** 2
    return total


@pytest.mark.validate
def test_the_papers_pair_is_refuted_by_the_papers_table(measured: MaterialVerdict) -> None:
    declared = measured.reference_model
    assert (declared.material.modulus, declared.material.damping) == (134.8e9, 2.08e9)
    assert declared.chi_squared == pytest.approx(chi_squared(134.8, 2.08), rel=1e-9)
    assert declared.chi_squared == pytest.approx(1828.5, abs=0.1)
    assert declared.degrees_of_freedom == 12
    assert not measured.adequate_before


@pytest.mark.validate
def test_every_constant_pair_is_refuted(measured: MaterialVerdict) -> None:
    best = measured.model("constant")
    modulus, viscous = best.material.modulus / 1e9, best.material.damping / 1e9
    assert best.chi_squared == pytest.approx(chi_squared(modulus, viscous), rel=1e-9)
    for step in (0.99, 1.01):
        assert chi_squared(step * modulus, viscous) > best.chi_squared
        assert chi_squared(modulus, step * viscous) > best.chi_squared
    assert best.p_value == pytest.approx(float(chi2.sf(best.chi_squared, 10)))
    assert best.p_value < 1e-8
    assert best.cross_validation is not None
    assert max(fit.p_value for fit in best.cross_validation.fits) < 1e-4
    assert all(reading.outcomes["constant"][2] < 1e-6 for reading in measured.error_assumptions)


@pytest.mark.validate
def test_relaxation_is_found_and_is_not_all(measured: MaterialVerdict) -> None:
    alone = measured.model("relaxation")
    assert alone.chi_squared == pytest.approx(32.66, abs=0.01)
    assert alone.chi_squared < measured.model("constant").chi_squared - 25.0
    assert measured.relaxation_floor == pytest.approx(30.04, abs=0.01)
    assert chi2.sf(measured.relaxation_floor, 10) < 0.01
    assert measured.verdict == "effects"
    names = [effect.name for effect in measured.effects]
    assert {"relaxation", "hysteresis"} < set(names)
    assert measured.chosen_model.p_value > 0.1
    assert measured.adequate_after
    assert ("hysteresis", "relaxation", "sensor_delay") in measured.confusable_effects


@pytest.mark.validate
def test_residuals_are_in_standard_deviations_of_the_table(measured: MaterialVerdict) -> None:
    declared = measured.reference_model
    frequency, size, size_sigma, phase, phase_sigma = ROWS[5]
    angle, blur = np.radians(phase), np.radians(phase_sigma)
    storage_sigma = np.hypot(np.cos(angle) * size_sigma, size * np.sin(angle) * blur)
    loss_sigma = np.hypot(np.sin(angle) * size_sigma, size * np.cos(angle) * blur)
    assert declared.storage_residuals[5] == pytest.approx((134.8 - size * np.cos(angle)) / storage_sigma)
    off = 2.0 * np.pi * frequency * 2.08 - size * np.sin(angle)
    assert declared.damping_residuals[5] == pytest.approx(off / loss_sigma)
    assert declared.damping_residuals[5] > 30.0
    assert np.max(np.abs([measured.chosen_model.storage_residuals, measured.chosen_model.damping_residuals])) < 2.0


@pytest.mark.validate
def test_errors_shrink_from_before_to_after(measured: MaterialVerdict) -> None:
    for role in ("fit", "check"):
        before, after = measured.error_before[role], measured.error_after[role]
        assert after.damping_rms < before.damping_rms
        assert after.storage_modulus_rms < before.storage_modulus_rms
    assert measured.error_after["fit"].damping_rms < 1.2 * measured.noise_floor.damping_rms


@pytest.mark.validate
def test_the_static_test_was_foreseen_by_relaxation(measured: MaterialVerdict) -> None:
    (check,) = [check for check in measured.static_checks if check.role == "relaxation"]
    assert check.predicted.low < check.measured < check.predicted.high
    assert abs(check.predicted.value - check.measured) < 2.0 * check.uncertainty
    robot = measured.model("robot")
    assert abs(robot.material.modulus - 102.2e9) < 2.2e9
    assert robot.chi_squared < measured.model("relaxation").chi_squared + 0.2


@pytest.mark.validate
def test_uncertainties_of_two_deviations_are_twice_those_of_one(measured: MaterialVerdict) -> None:
    """The paper's table with all of them doubled, static rows included."""

    def doubled(row: MaterialRow) -> MaterialRow:
        quantities = {
            name: replace(each, uncertainty=each.uncertainty and 2.0 * each.uncertainty)
            for name, each in row.quantities.items()
        }
        return replace(row, quantities=quantities)

    table = replace(
        measured.table,
        rows=tuple(map(doubled, measured.table.rows)),
        static_rows=tuple(map(doubled, measured.table.static_rows)),
    )
    declared = pair_of_row(measured.table, PAPER_PAIR_FREQUENCY)
    found = trace_material(table, declared, MaterialOptions(coverage_factor=2.0))
    for role in ("chosen", "relaxation", "robot"):
        assert found.model(role).chi_squared == pytest.approx(measured.model(role).chi_squared, rel=1e-6)
    uncertainties = [[check.uncertainty for check in each.static_checks] for each in (found, measured)]
    assert uncertainties[0] == pytest.approx(uncertainties[1])


@pytest.mark.validate
def test_the_document_reads_like_a_trace(measured: MaterialVerdict) -> None:
    document = json.loads(json.dumps(material_document(measured), allow_nan=False))
    needed = {"verdict", "effects", "also_possible", "formula", "error_before", "error_after", "noise_floor"}
    assert needed | {"residual_is_noise", "seconds"} <= set(document)
    for effect in document["effects"]:
        assert {"name", "cables", "parameters", "component", "evidence"} <= set(effect)
        for estimate in effect["parameters"].values():
            assert estimate["low"] <= estimate["value"] <= estimate["high"]
            assert estimate["unit"]
    assert len(document["models"][0]["damping_sigmas"]) == 6
    relaxation = document["robot"]["effect"]["relaxation"]
    assert set(relaxation) == {"modulus", "time"}


@pytest.mark.validate
def test_the_words_hold_the_figures(measured: MaterialVerdict) -> None:
    said = verdict_sentence(measured)
    assert "rejected" in said
    assert "1828" in said
    assert "relaxation and hysteresis" in said
    text = " ".join(verdict_notes(measured))
    assert "5 Hz: storage_modulus is written 1.31e+11, |E*| cos phi gives 1.318e+11 (disagrees)" in text
    assert "whichever row is left out" in text
    assert "the strain amplitude falls with frequency" in text
    assert "no passive linear solid" in text


@pytest.mark.validate
def test_the_figure_shows_every_row_and_both_models(measured: MaterialVerdict) -> None:
    figure = material_figure(measured)
    storage, viscous = figure.axes[0], figure.axes[1]
    for axes, values in ((storage, measured.observations.storage), (viscous, measured.observations.damping)):
        points = axes.containers[0].lines[0]
        assert points.get_ydata() == pytest.approx(values / 1e9)
    assert "GPa" in storage.get_ylabel()
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert [label.split(":")[0] for label in labels[:4]] == [
        "declared",
        "best constant pair",
        "relaxation alone",
        "chosen",
    ]


def test_the_pair_of_a_row_is_as_written_or_worked_out(tmp_path: Path) -> None:
    seen = observed(CONSTANT, FREQUENCY)
    pair = pair_of_row(read_material_table(written(tmp_path / "t.csv", seen)), FREQUENCY[2])
    assert (pair.modulus, pair.damping) == pytest.approx((131e9, 0.49e9))
    with pytest.raises(InputError, match=r"--at: 3 Hz is no row .* give one of 0.1, 1, 2, 5, 10, 20"):
        pair_of_row(read_material_table(PAPER_TABLE), 3.0)


@pytest.mark.validate
def test_a_constant_pair_that_is_right_is_left_alone(tmp_path: Path) -> None:
    table = read_material_table(written(tmp_path / "t.csv", observed(CONSTANT, FREQUENCY, 0.02, seed=1)))
    verdict = trace_material(table, CONSTANT)
    assert (verdict.verdict, verdict.effects, verdict.confusable_effects) == ("none", (), ())
    assert verdict.adequate_before
    assert verdict.error_after == verdict.error_before
    assert "is adequate" in verdict_sentence(verdict)


def test_a_wrong_pair_is_distinguished_from_a_wrong_law(tmp_path: Path) -> None:
    table = read_material_table(written(tmp_path / "t.csv", observed(CONSTANT, FREQUENCY, 0.02, seed=1)))
    verdict = trace_material(table, replace(CONSTANT, damping=0.8e9))
    assert verdict.verdict == "effects"
    assert [effect.name for effect in verdict.effects] == ["damping"]
    estimate = verdict.effects[0].parameters["damping"]
    assert estimate.declared == 0.8e9
    assert estimate.low < 0.49e9 < estimate.high
    assert verdict.adequate_after


@pytest.mark.validate
def test_rows_that_no_model_follows_are_unexplained(tmp_path: Path) -> None:
    seen = observed(CONSTANT, FREQUENCY, 0.01)
    zigzag = replace(seen, storage=seen.storage * (1.0 + 0.1 * (-1.0) ** np.arange(8)))
    verdict = trace_material(read_material_table(written(tmp_path / "t.csv", zigzag)), CONSTANT)
    assert (verdict.verdict, verdict.effects) == ("unexplained", ())
    assert not verdict.adequate_after
    assert "No model here" in verdict_sentence(verdict)


def test_a_robot_takes_the_rope() -> None:
    rope = robot_material(
        Material(
            100e9,
            0.3e9,
            (MaxwellBranch(5e9, 2e-4), MaxwellBranch(20e9, 0.1), MaxwellBranch(30e9, 2.0)),
            loss_modulus=4e9,
        )
    )
    assert rope.damping == pytest.approx(0.3e9 + 5e9 * 2e-4)
    assert rope.relaxation == {"modulus": 20e9, "time": 0.1, "modulus_2": 30e9, "time_2": 2.0}
    robot = with_material(example("three"), rope)
    assert {(cable.modulus, cable.damping) for cable in robot.cables} == {(100e9, rope.damping)}
    (setting,) = [setting for setting in robot.effects if setting.name == "relaxation"]
    assert setting.cables == (1, 2, 3)
    assert {name: setting.values[name] for name in rope.relaxation} == rope.relaxation
    assert setting.values["modulus_3"] == 0.0
    assert declared_material(robot, "robot.toml") == Material(100e9, rope.damping, rope.branches)


def test_more_branches_than_a_robot_file_holds_are_refused() -> None:
    with pytest.raises(ArgumentError, match="has 4 branches, a robot file holds 3"):
        robot_material(Material(100e9, 0.3e9, tuple(MaxwellBranch(5e9, time) for time in (0.1, 0.3, 1.0, 3.0))))


def test_what_acts_in_a_robots_ropes_is_declared() -> None:
    branches = {"modulus": 20e9, "time": 0.3, "modulus_3": 10e9, "time_3": 4.0}
    robot = example("three")
    for name, values in (("modulus", {"modulus": 1.1e11}), ("damping", {"damping": 7e8}), ("relaxation", branches)):
        robot = robot.with_effect(EffectSetting(name, values, robot.cable_numbers))
    assert declared_material(robot, "robot.toml") == Material(
        1.1e11, 7e8, (MaxwellBranch(20e9, 0.3), MaxwellBranch(10e9, 4.0))
    )
    alone = example("three").with_effect(EffectSetting("damping", {"damping": 7e8}, (2,)))
    with pytest.raises(InputError, match="2 different ropes"):
        declared_material(alone, "robot.toml")


@pytest.mark.validate
def test_a_declared_relaxation_that_is_right_is_left_alone(tmp_path: Path) -> None:
    relaxing = replace(CONSTANT, branches=(MaxwellBranch(60e9, 0.15),))
    table = read_material_table(written(tmp_path / "t.csv", observed(relaxing, FREQUENCY, 0.02, seed=1)))
    robot = with_material(example("three"), robot_material(relaxing))
    verdict = trace_material(table, declared_material(robot, "robot.toml"))
    assert (verdict.verdict, verdict.effects) == ("none", ())
    assert trace_material(table, CONSTANT).effects[0].name == "relaxation"
    assert verdict.reference_model.label == "damping + relaxation"


@pytest.mark.validate
def test_a_robot_takes_the_uncertainties_of_its_new_rope(tmp_path: Path) -> None:
    error = 0.02
    table = read_material_table(written(tmp_path / "t.csv", observed(CONSTANT, FREQUENCY, error, seed=1)))
    robot = example("three")
    cables = tuple(replace(each, modulus_uncertainty=3e11, damping_uncertainty=2e10) for each in robot.cables)
    (folder := tmp_path / "out").mkdir()
    verdict = trace_material(table, CONSTANT)
    write_material(verdict, folder, replace(robot, cables=cables))
    cable = read_robot(folder / "robot.toml").cables[0]
    # Of a mean of eight rows that are known to 2 % each, if all of them counted for the modulus alone.
    least = error * CONSTANT.modulus / math.sqrt(len(FREQUENCY))
    assert cable.modulus_uncertainty > 0.9 * least
    for estimate, deviation in zip(
        verdict.model("robot").estimates, (cable.modulus_uncertainty, cable.damping_uncertainty), strict=False
    ):
        assert not (estimate.low_is_open or estimate.high_is_open)
        assert 2.0 * 1.96 * deviation == pytest.approx(estimate.high - estimate.low, rel=1e-3)
    declared = json.loads((folder / "fit.json").read_text())["robot"]
    assert declared["modulus_uncertainty"] == pytest.approx(cable.modulus_uncertainty)


def test_a_robot_of_two_ropes_is_refused() -> None:
    robot = example("three")
    other = replace(robot.cables[0], modulus=1e11)
    with pytest.raises(InputError, match="2 different ropes"):
        declared_material(replace(robot, cables=(other, *robot.cables[1:])), "robot.toml")
