"""Discrete outputs hold over a macro step and jump between steps."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from tautwire.cosimulation import Connection, Port
from tautwire.cosimulation.zero_order_hold import ZeroOrderHold


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


def test_only_discrete_outputs_are_held() -> None:
    _, _, held = system()
    assert held.ports == (Port("a", "rate"), Port("b", "mode"))
    shown = np.array([1.0, 2.0, 3.0, 4.0])
    assert held.begin_step(shown)
    shown[:] = [10.0, 20.0, 30.0, 40.0]
    held.apply(shown)
    assert shown.tolist() == [1.0, 20.0, 3.0, 40.0]


def test_at_the_end_what_the_components_show_counts_and_tells_of_a_jump() -> None:
    parts, _, held = system()
    shown = np.array([1.0, 2.0, 3.0, 4.0])
    held.begin_step(shown)
    parts["a"].now["rate"], parts["b"].now["mode"] = 1.0, 3.0
    held.end_step(shown)
    assert not held.begin_step(shown)
    parts["a"].now["rate"] = 5.0
    held.end_step(shown)
    assert shown.tolist() == [5.0, 2.0, 3.0, 4.0]
    assert held.begin_step(shown) and not held.begin_step(shown)


def test_after_going_back_every_value_counts_as_new() -> None:
    _, _, held = system()
    shown = np.array([1.0, 2.0, 3.0, 4.0])
    held.begin_step(shown)
    held.reset()
    assert held.begin_step(shown)


def test_inputs_that_jump_are_those_wired_to_discrete_outputs() -> None:
    _, _, held = system()
    wires = [Connection(Port("a", name), Port("c", f"{name}_in")) for name in ("rate", "speed")]
    assert held.targets(wires) == [Port("c", "rate_in")]


def test_system_without_discrete_outputs_is_left_alone() -> None:
    parts: dict[str, Any] = {"a": Fake(speed="continuous")}
    held = ZeroOrderHold(parts, [Port("a", "speed")])
    shown = np.array([1.0])
    assert not held.begin_step(shown)
    held.apply(shown)
    held.end_step(shown)
    assert shown.tolist() == [1.0]
