"""One macro step: halved where it is rejected, split at state events."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

from tautwire.cosimulation import ComponentError
from tautwire.cosimulation.macro_step import (
    EVENT_WIDTH,
    MAX_HALVINGS,
    MAX_SUBSTEPS,
    _land_before_event,
    step_with_events,
    step_with_rejection,
)

STEP = 0.01


class ClockSolver:
    """A solver whose whole state is the time: its indicators are functions of it, and long steps diverge.

    Steps above ``max_step`` (s) diverge, or an FMU fails in them with ``status``. ``substeps`` are the lengths of the
    steps that were not rolled back, ``attempts`` those of all attempted ones.
    """

    def __init__(
        self,
        max_step: float = np.inf,
        status: str | None = None,
        indicator: Callable[[float], float] = lambda time: 1.0,
        supports_rollback: bool = True,
    ) -> None:
        self.max_step, self.status, self.indicator = max_step, status, indicator
        self.state = SimpleNamespace(diverged=False)
        self.graph = SimpleNamespace(supports_rollback=supports_rollback, supports_variable_step=True)
        self.substeps: tuple[float, ...] = ()
        self.attempts: list[float] = []
        self.resets: list[float] = []
        self.open_checkpoints = 0

    @property
    def time(self) -> float:
        return sum(self.substeps)

    def attempt_step(self, time: float, step: float, start: np.ndarray, end: np.ndarray) -> tuple[float, ...]:
        checkpoint = self.substeps
        self.attempts.append(step)
        self.state.diverged = step > self.max_step
        if self.state.diverged and self.status is not None:
            raise ComponentError("cable_1", "fmi2DoStep", self.status, time, {}, ())
        self.step(time, step, start, end)
        self.open_checkpoints += 1
        return checkpoint

    def step(self, time: float, step: float, start: np.ndarray, end: np.ndarray) -> None:
        assert time == pytest.approx(self.time, abs=1e-12)
        self.substeps = (*self.substeps, step)

    def restore(self, checkpoint: tuple[float, ...]) -> None:
        self.substeps = checkpoint

    def release(self, checkpoint: tuple[float, ...]) -> None:
        self.open_checkpoints -= 1

    def event_indicators(self) -> np.ndarray:
        return np.array([self.indicator(self.time)])

    def reset_history(self, time: float) -> None:
        self.resets.append(time)


def no_inputs(time: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros(0), np.zeros(0)


def accepted_length(solver: ClockSolver) -> float:
    """Length of the accepted step after one of 0.16 s was attempted."""
    return step_with_rejection(solver, 0.0, 0.16, no_inputs)[0]  # type: ignore[arg-type]


def first_substep(solver: ClockSolver) -> float:
    """Length of the first substep of a macro step of ``STEP``."""
    return step_with_events(solver, 0.0, STEP, no_inputs)  # type: ignore[arg-type]


@pytest.mark.parametrize("status", [None, "discard", "error"])
def test_a_step_is_halved_until_it_converges(status: str | None) -> None:
    solver = ClockSolver(0.05, status)
    assert accepted_length(solver) == pytest.approx(0.04)
    assert solver.attempts == pytest.approx([0.16, 0.08, 0.04])
    assert solver.substeps == pytest.approx([0.04])
    assert solver.open_checkpoints == 1


def test_the_shortest_step_is_accepted_even_if_it_diverges() -> None:
    solver = ClockSolver(0.0)
    assert accepted_length(solver) == pytest.approx(0.16 / 2**MAX_HALVINGS)
    assert solver.state.diverged


@pytest.mark.parametrize(("status", "attempts"), [("discard", MAX_HALVINGS + 1), ("fatal", 1)])
def test_an_fmu_that_fails_in_the_shortest_step_raises_its_error(status: str, attempts: int) -> None:
    solver = ClockSolver(0.0, status)
    with pytest.raises(ComponentError, match=status):
        accepted_length(solver)
    assert len(solver.attempts) == attempts


def test_a_step_without_event_stays_whole() -> None:
    solver = ClockSolver()
    assert first_substep(solver) == STEP
    assert solver.substeps == (STEP,)
    assert solver.resets == []
    assert solver.open_checkpoints == 0


def test_after_a_rejection_substeps_double_until_the_step_is_complete() -> None:
    solver = ClockSolver(0.3 * STEP)
    assert first_substep(solver) == 0.25 * STEP
    assert np.array(solver.attempts) / STEP == pytest.approx([1.0, 0.5, 0.25, 0.25, 0.5, 0.25, 0.25])
    assert np.array(solver.substeps) / STEP == pytest.approx([0.25, 0.25, 0.25, 0.25])
    assert solver.open_checkpoints == 0


@pytest.mark.parametrize("event", [5e-6, 0.003, 0.009995])
def test_a_step_is_split_just_before_and_just_after_an_event(event: float) -> None:
    solver = ClockSolver(indicator=lambda time: time - event)
    first = first_substep(solver)
    ends = np.cumsum(solver.substeps)
    assert first == solver.substeps[0]
    assert 0.0 <= event - ends[ends < event][-1] <= 2.0 * EVENT_WIDTH
    assert 0.0 < ends[ends > event][0] - event <= 2.0 * EVENT_WIDTH
    assert ends[-1] == pytest.approx(STEP, abs=1e-12)
    assert len(ends) <= 10
    assert solver.open_checkpoints == 0


def test_the_extrapolation_history_is_reset_after_an_event() -> None:
    solver = ClockSolver(indicator=lambda time: time - 0.003)
    first_substep(solver)
    assert 0.0 < solver.resets[-1] - 0.003 <= 2.0 * EVENT_WIDTH


def test_without_rollback_events_are_stepped_over() -> None:
    solver = ClockSolver(max_step=0.001, indicator=lambda time: time - 0.003, supports_rollback=False)
    assert first_substep(solver) == STEP
    assert solver.substeps == (STEP,)


class ChatteringSolver(ClockSolver):
    """A solver whose event indicator changes its sign in every step."""

    def event_indicators(self) -> np.ndarray:
        return np.array([(-1.0) ** len(self.substeps)])


def test_where_an_indicator_chatters_the_number_of_substeps_is_bounded() -> None:
    solver = ChatteringSolver()
    first_substep(solver)
    assert solver.time == pytest.approx(STEP, abs=1e-12)
    assert len(solver.substeps) == MAX_SUBSTEPS + 1


def test_the_retreat_from_a_zero_crossing_ends_where_the_sign_has_changed_at_every_span() -> None:
    """During the search the sign may hold at a span where it has changed on the retreat."""
    changed_spans = {1.0, *(0.5 - near * 4.0**k for near in (1e-3, 5e-4) for k in range(5))}
    spans: list[float] = []

    def indicators_after(span: float) -> np.ndarray:
        spans.append(span)
        assert len(spans) < 100
        has_changed = any(abs(span - changed) < 1e-5 for changed in changed_spans)
        return np.array([-1.0 if has_changed else 0.5 - span])

    step = _land_before_event(indicators_after, 1.0, np.ones(1), -0.5 * np.ones(1), np.array([0]))
    assert spans[-1] == step
    assert 0.0 < step < 0.5
    assert indicators_after(step)[0] > 0.0
