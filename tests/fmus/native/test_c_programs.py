"""Native FMUs in programs without Python."""

from __future__ import annotations

import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave

from tautwire.fmus.packaging import build_fmus
from tautwire.robot.reference_simulation import integrate
from tests.support.c_programs import RAMPS, STEP, STEPS, compile_host, extracted, numbers, robot_plan
from tests.support.effect_cases import same
from tests.support.effects import with_effects
from tests.support.robots import paper_robot

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


@needs_compiler
def test_a_c_program_runs_the_robot_without_python(tmp_path: Path) -> None:
    fmus = build_fmus(paper_robot(), tmp_path / "built", native=True)
    plan = robot_plan(extracted(fmus, tmp_path))
    shown = numbers(compile_host(["cc"], tmp_path)(plan.text()))
    assert shown == pytest.approx(plan.in_python(), abs=1e-12)
    until = STEPS * STEP
    run = integrate(paper_robot(), np.array([0.0, until]), np.array([[0.0] * 3, [rate * until for rate in RAMPS]]))
    assert np.linalg.norm(np.array(shown) - run.position[-1]) < 0.5e-3


@pytest.mark.validate
def test_sixty_four_instances_in_eight_threads_give_the_same_bits(tmp_path: Path) -> None:
    robot = with_effects(paper_robot(), same("hysteresis", force=60.0, yield_strain=1e-4))
    folder = tmp_path / "cable"
    fmpy.extract(str(build_fmus(robot, tmp_path / "built", native=True).cables[0]), str(folder))
    description = fmpy.read_model_description(str(folder))
    references = {variable.name: variable.valueReference for variable in description.modelVariables}
    name = description.coSimulation.modelIdentifier

    def run(number: int) -> list[float]:
        fmu = FMU2Slave(guid=description.guid, unzipDirectory=str(folder), modelIdentifier=name)
        fmu.instantiate()
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        shown = []
        for step in range(200):
            fmu.setReal([references["winch_speed"]], [0.3 * np.sin(0.1 * step)])
            fmu.doStep(currentCommunicationPoint=0.01 * step, communicationStepSize=0.01)
            shown += fmu.getReal([references["tension"], references["force_rate.x"]])
        # Not freeInstance, with which fmpy also unloads the library under the others.
        fmu.dll.fmi2FreeInstance(fmu.component)
        return shown

    expected = run(0)
    with ThreadPoolExecutor(8) as threads:
        assert all(shown == expected for shown in threads.map(run, range(64)))
    assert len(set(expected)) > 100
