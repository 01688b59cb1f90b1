"""The state of a coupled system is taken back by a rollback, but for what the run has cost."""

import numpy as np

from tautwire.cosimulation.coupling_state import CouplingState
from tautwire.cosimulation.extrapolation import restart_history
from tautwire.cosimulation.run_statistics import RunStatistics


def test_rollback_takes_back_all_but_the_sweeps() -> None:
    outputs, inputs = np.array([1.0, 2.0]), np.array([3.0])
    history = restart_history(0.0, outputs)
    state = CouplingState(outputs, inputs, np.array([4.0]), np.array([2.0]), RunStatistics(steps=1, sweeps=2), history)
    saved = state.copy()
    outputs[:], inputs[:] = 9.0, 9.0
    state.external_values, state.pending_input_time, state.diverged = np.array([9.0]), 0.5, True
    state.extrapolation_history = restart_history(0.5, outputs)
    state.statistics.steps, state.statistics.sweeps = 5, 7
    state.restore(saved)
    assert state.outputs is outputs and outputs.tolist() == [1.0, 2.0]
    assert state.inputs is inputs and inputs.tolist() == [3.0]
    assert state.external_values.tolist() == [4.0]
    assert state.extrapolation_history is history
    assert (state.pending_input_time, state.diverged) == (None, False)
    assert state.statistics == RunStatistics(steps=1, sweeps=7)


def test_sampled_outputs_count_as_jumps_after_a_rollback() -> None:
    history = restart_history(0.0, np.zeros(1))
    state = CouplingState(np.zeros(1), np.zeros(0), np.zeros(0), np.array([2.0]), RunStatistics(), history)
    state.restore(state.copy())
    assert np.isnan(state.held_values).all()
