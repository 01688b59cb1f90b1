"""What an FMU tells its user: default experiment, origin, documentation, licenses and icon."""

import io
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from PIL import Image

import tautwire
from tautwire.fmus.fmu_documentation import LAWS, WHOLE_ROBOT
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import EffectSetting, Formula
from tests.pictures.component_icons import ICONS, draw_icons
from tests.support.robots import paper_robot


def entry(fmu: Path, name: str) -> bytes:
    with zipfile.ZipFile(fmu) as archive:
        return archive.read(name)


def page(fmu: Path) -> str:
    return entry(fmu, "documentation/index.html").decode("utf-8")


def test_the_model_description_states_origin_and_default_experiment(winch_fmus: RobotFmus) -> None:
    for path in winch_fmus.by_component.values():
        description = fmpy.read_model_description(str(path))
        assert description.version == tautwire.__version__
        assert description.generationTool == f"Tautwire {tautwire.__version__}"
        assert description.license == "MIT"
        experiment = description.defaultExperiment
        numbers = (experiment.startTime, experiment.stopTime, experiment.stepSize, experiment.tolerance)
        assert tuple(map(float, numbers)) == (0.0, 10.0, 1e-3, 1e-9)


def test_the_default_experiment_runs_as_it_stands(three_fmus: RobotFmus) -> None:
    rows = fmpy.simulate_fmu(str(three_fmus.platform), output=["position.z"])
    assert rows["time"][-1] == 10.0
    assert rows["position.z"][-1] == pytest.approx(5.0, abs=1e-9)


def test_the_page_states_robot_law_and_every_variable_with_its_unit_and_start_value(winch_fmus: RobotFmus) -> None:
    phrases = {
        "platform": "(m + sum of added masses) a = sum of cable forces",
        "winch_2": "a = 2 zeta w (c - v) + z",
        "cable_3": "This cable follows the logarithmic law.",
    }
    for name, phrase in phrases.items():
        path = winch_fmus.by_component[name]
        text, description = page(path), fmpy.read_model_description(str(path))
        assert phrase in text
        assert description.description in text
        assert description.description.endswith(" of paper")
        for variable in description.modelVariables:
            assert f"<tr><td>{variable.name}</td><td>{variable.unit}</td>" in text
            assert variable.start is None or f'<td class="number">{variable.start}</td>' in text


@pytest.mark.validate
def test_the_page_explains_effects_and_formulas(tmp_path: Path) -> None:
    formulas = (Formula("tension", "10 * tanh(travel)", (1,)), Formula("tension", "2 * sin(time)", (1,)))
    robot = replace(paper_robot(), name="Q&A <7>", formulas=formulas)
    text = page(
        build_fmus(robot.with_effect(EffectSetting("friction", {"coefficient": 0.1}, (1,))), tmp_path).cables[0]
    )
    assert "cable 1 of Q&amp;A &lt;7&gt;" in text
    assert "friction of the exit pulley" in text
    assert "the capstan equation" in text
    assert "tension: 10 * tanh(travel) + 2 * sin(time)" in text


def test_licenses_of_all_that_travels_inside_are_there(three_fmus: RobotFmus) -> None:
    text = entry(three_fmus.platform, "documentation/licenses/license.txt").decode("utf-8")
    assert "Copyright (c) 2026 The Tautwire developers" in text
    assert "NTNU" in text


def test_each_kind_of_component_has_its_icon(winch_fmus: RobotFmus, tmp_path: Path) -> None:
    draw_icons(tmp_path)
    assert set(ICONS) == {*LAWS, WHOLE_ROBOT}
    for name, kind in {"platform": "point_mass", "cable_1": "cable", "winch_1": "winch"}.items():
        icon = Image.open(io.BytesIO(entry(winch_fmus.by_component[name], "model.png")))
        drawn = Image.open(tmp_path / f"{kind}.png")
        assert (icon.format, icon.size) == ("PNG", drawn.size)
        difference = np.subtract(np.asarray(icon.convert("RGB")), np.asarray(drawn.convert("RGB")), dtype=float)
        assert np.abs(difference).mean() < 2.0
