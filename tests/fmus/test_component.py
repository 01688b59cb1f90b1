"""What the master does with FMUs that fail."""

from pathlib import Path

import numpy as np
import pytest

from tautwire.cosimulation import (
    Component,
    ComponentError,
    CouplingSolver,
    Experiment,
    FixedStep,
    MemoryRecorder,
    PiecewiseLinearInput,
    simulate,
)
from tautwire.cosimulation.robot_cosimulation import RunError, cosimulate, instantiate_robot
from tautwire.cosimulation.robot_wiring import recorded_ports
from tautwire.fmus.packaging import RobotFmus


def test_a_failing_fmu_is_named_with_time_and_inputs(three_fmus: RobotFmus) -> None:
    with Component("left", three_fmus.cables[0]) as component:
        component.initialize(0.0, {})
        component.run()
        at_anchor = component.block(["position.x", "position.y", "position.z"])
        at_anchor.values[:] = [0.0, 50.0, 50.0]
        component.write(at_anchor)
        with pytest.raises(ComponentError) as caught:
            component.step(0.25, 0.01)
    assert caught.value.component == "left"
    assert caught.value.time == 0.25
    assert caught.value.inputs["position.y"] == 50.0
    assert "division by zero" in str(caught.value)


@pytest.mark.filterwarnings("ignore:invalid value encountered in multiply")
def test_a_value_that_is_not_finite_stops_the_run(three_fmus: RobotFmus) -> None:
    speeds = np.array([[0.0, 0.0, 0.0], [0.0, np.inf, 0.0]])
    source = PiecewiseLinearInput(np.array([0.0, 0.1]), speeds)
    experiment = Experiment(source, source.time, FixedStep(0.01))
    with instantiate_robot(three_fmus) as graph, pytest.raises(ComponentError, match="have to be finite"):
        simulate(CouplingSolver(graph), experiment, recorded_ports(3), MemoryRecorder(2, 18))


def test_folders_go_when_the_block_ends(three_fmus: RobotFmus) -> None:
    with Component("left", three_fmus.cables[0]) as component:
        folder = Path(component.folder)
        assert folder.is_dir()
    assert not folder.exists()


def test_a_run_that_fails_keeps_what_came_before(three_fmus: RobotFmus) -> None:
    time = np.array([0.0, 0.1, 0.2, 0.3])
    speeds = np.zeros((4, 3))
    speeds[3, 1] = 1e300
    with pytest.raises(RunError, match=r"FMU cable_2: fmi2DoStep gave 'discard' at 0\.2") as caught:
        cosimulate(three_fmus, time, speeds)
    assert caught.value.result.time.tolist() == [0.0, 0.1, 0.2]
    assert np.isfinite(caught.value.result.tension).all()
    assert caught.value.cause.component == "cable_2"
