"""Discrete outputs hold over a macro step and jump between steps."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from tautwire.cosimulation import Connection, Port
from tautwire.cosimulation.zero_order_hold import ZeroOrderHold, inputs_from_discrete_outputs


class Fake:
    """A component with outputs that a test sets."""

    def __init__(self, **outputs: str) -> None:
        self.variables = {name: SimpleNamespace(variability=kind) for name, kind in outputs.items()}
        self.now = dict.fromkeys(outputs, 0.0)

    def block(self, names: list[str]) -> Any:
        return SimpleNamespace(names=names, values=np.zeros(len(names)))

    def read(self, block: Any) -> None:
        block.values[:] = [self.now[name] for name in block.names]


def system() -> tuple[dict[str, Any], list[Port], ZeroOrderHold]:
    parts: dict[str, Any] = {
        "a": Fake(speed="continuous", rate="discrete"),
        "b": Fake(mode="discrete", place="continuous"),
    }
    shown = [Port("a", "rate"), Port("a", "speed"), Port("b", "mode"), Port("b", "place")]
    return parts, shown, ZeroOrderHold(parts, shown)


def test_only_discrete_outputs_are_extrapolated_as_constants() -> None:
    _, _, held = system()
    assert held.ports == (Port("a", "rate"), Port("b", "mode"))
    shown = np.array([1.0, 2.0, 3.0, 4.0])
    values = held.sample(shown)
    shown[:] = [10.0, 20.0, 30.0, 40.0]
    held.apply(shown, values)
    assert shown.tolist() == [1.0, 20.0, 3.0, 40.0]


def test_at_the_end_what_the_components_show_counts() -> None:
    parts, _, held = system()
    shown = np.array([1.0, 2.0, 3.0, 4.0])
    parts["a"].now["rate"], parts["b"].now["mode"] = 5.0, 3.0
    held.end_step(shown)
    assert shown.tolist() == [5.0, 2.0, 3.0, 4.0]
    assert held.sample(shown).tolist() == [5.0, 3.0]


def test_first_sample_counts_as_a_jump() -> None:
    _, _, held = system()
    assert not np.array_equal(held.initial_values(), held.sample(np.zeros(4)))


def test_inputs_that_jump_are_those_wired_to_discrete_outputs() -> None:
    parts, _, _ = system()
    wires = [Connection(Port("a", name), Port("c", f"{name}_in")) for name in ("rate", "speed")]
    assert inputs_from_discrete_outputs(parts, wires) == [Port("c", "rate_in")]


def test_system_without_discrete_outputs_is_left_alone() -> None:
    parts: dict[str, Any] = {"a": Fake(speed="continuous")}
    held = ZeroOrderHold(parts, [Port("a", "speed")])
    shown = np.array([1.0])
    values = held.sample(shown)
    assert np.array_equal(values, held.initial_values())
    held.apply(shown, values)
    held.end_step(shown)
    assert shown.tolist() == [1.0]
