"""The tensile machine around a cable FMU against the closed form of its rope."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.materials import PAPER_TABLE, RobotMaterial, read_material_table
from tautwire.materials.table_consistency import consistency_checks
from tautwire.materials.viscoelastic_model import Material, MaxwellBranch, complex_modulus
from tautwire.paper.rope_tests import (
    DISC_AREA,
    METALLIC_AREA,
    dynamic_modulus_error,
    loop_complex_modulus,
    printed_rope,
    relaxing_rope,
    rope_test_values,
    run_tensile_and_dynamic_tests,
    tensile_modulus,
    tensile_modulus_error,
)

ROPE = RobotMaterial(1.0e11, 0.4e9, (MaxwellBranch(3e10, 1.5),))


@pytest.mark.validate
def test_loops_have_the_complex_modulus_of_the_rope() -> None:
    runs = run_tensile_and_dynamic_tests(ROPE)
    material = Material(ROPE.modulus, ROPE.damping, ROPE.branches)
    assert list(runs.loops) == [0.1, 1.0, 2.0, 5.0, 10.0, 20.0]
    for frequency, loop in runs.loops.items():
        expected = complex(complex_modulus(material, frequency))
        assert abs(loop_complex_modulus(frequency, loop) - expected) < 1e-3 * abs(expected), frequency
        assert loop.load[-1] == pytest.approx(loop.load[0], abs=1.0), "a loop closes"


@pytest.mark.validate
def test_elastic_rope_returns_its_modulus_by_equation_7() -> None:
    runs = run_tensile_and_dynamic_tests(printed_rope())
    assert tensile_modulus(runs.tensile, METALLIC_AREA) == pytest.approx(102.2e9, rel=1e-6)
    assert tensile_modulus(runs.tensile, DISC_AREA) == pytest.approx(102.2e9 * METALLIC_AREA / DISC_AREA, rel=1e-6)
    assert 102.2 * tensile_modulus_error(runs.tensile, 0.5) == pytest.approx(2.2, abs=0.01), "half of 0.03 mm each"
    assert tensile_modulus_error(runs.tensile, 1.0) == pytest.approx(2.0 * tensile_modulus_error(runs.tensile, 0.5))
    assert abs(np.argmax(runs.tensile.load) - len(runs.tensile.load) // 2) <= 1, "up and down again"


@pytest.mark.validate
def test_relaxing_rope_has_the_static_modulus_and_most_of_the_rise() -> None:
    rope = relaxing_rope()
    assert rope.modulus == pytest.approx(102.2e9, rel=0.02)
    runs = run_tensile_and_dynamic_tests(rope)
    values = rope_test_values(runs, 1.0)
    assert values["material.modulus"] == pytest.approx(102.2, abs=2.2)
    rise = loop_complex_modulus(1.0, runs.loops[1.0]).real - loop_complex_modulus(0.1, runs.loops[0.1]).real
    assert 0.5 * 16.8e9 < rise < 16.8e9


def test_errors_of_section_3_1_are_far_more_than_those_of_table_1() -> None:
    relative = [dynamic_modulus_error(row, 1.0) for row in read_material_table(PAPER_TABLE).rows]
    # 0.03 mm of 0.201 mm at 0.1 Hz, and of 0.061 mm at 20 Hz; 1 N of 500 and of 172 N.
    assert (relative[0], relative[-1]) == pytest.approx((0.1492, 0.4913), abs=5e-4)


def test_columns_of_table_1_follow_from_each_other_but_for_two_moduli() -> None:
    odd = [
        check.frequency
        for check in consistency_checks(read_material_table(PAPER_TABLE))
        if check.column == "storage_modulus" and check.agreement == "disagrees"
    ]
    assert odd == [2.0, 5.0]
