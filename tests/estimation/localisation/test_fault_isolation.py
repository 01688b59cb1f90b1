"""Which component is in question: each row of the table, and the words."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.estimation.localisation.component_residuals import ComponentResidual, FaultLocalisation
from tautwire.estimation.localisation.fault_isolation import (
    isolate_fault,
    isolation_verdict,
    numbered,
    reconciled_with_effects,
)

FINE = {1: False, 2: False, 3: False}
SECOND = {1: False, 2: True, 3: False}
ALL = {1: True, 2: True, 3: True}


@pytest.mark.parametrize(
    ("off", "platform", "closes", "exits", "said"),
    [
        (FINE, False, False, (), "nothing"),
        (FINE, True, False, (), "platform"),
        (SECOND, False, False, (), "cable 2 (rope or winch)"),
        (SECOND, False, False, (2,), "cable 2 (rope, winch or exit point)"),
        (ALL, False, False, (2,), "cables 1, 2, 3 (rope or winch) or the position sensor"),
        (SECOND, True, True, (), "load cell 2 or friction before it"),
        (SECOND, True, False, (), "load cell 2; exit point 2 or several components"),
        (
            ALL,
            True,
            False,
            (),
            "load cells 1, 2, 3; exit points 1, 2, 3; the position sensor or several components",
        ),
        ({1: False, 3: True}, None, False, (), "cable 3 (rope, winch, load cell or exit point)"),
        ({1: False, 3: False}, None, False, (), "nothing in cables 1, 3; cannot tell more"),
        ({}, None, False, (), "cannot tell"),
    ],
)
def test_each_row(off: dict[int, bool], platform: bool | None, closes: bool, exits: tuple[int, ...], said: str) -> None:
    assert isolate_fault(off, platform, closes, exits) == said


def part(component: str, quantity: str, rms: float, rings_at: float | None = None) -> ComponentResidual:
    return ComponentResidual(component, quantity, "N", np.zeros(3), 0.0, rms, 1.3, 1.2, None, rings_at)


def test_the_sentence_has_the_figures() -> None:
    cables = [part("cable 1", "tension", 1.2), part("cable 2", "tension", 14.1)]
    platform = [part("platform", "force x", 1.3)]
    assert isolation_verdict(cables, platform) == (
        "cable 2 (rope or winch)",
        "Cable 2's tension deviates by 14 N rms (expected 1.3 N); the platform's force balance closes as expected. "
        "In question: cable 2 (rope or winch).",
    )


def test_a_constant_force_is_told_as_such_and_not_as_what_swings() -> None:
    constant = replace(part("platform", "force z", 9.33, rings_at=1.31), mean=-9.331)
    _, sentence = isolation_verdict([part("cable 1", "tension", 1.3)], [constant])
    assert "force z deviates by 9.3 N rms, -9.3 N in the mean (expected 1.3 N)" in sentence
    assert "oscillates" not in sentence
    _, sentence = isolation_verdict([part("cable 1", "tension", 1.3)], [replace(constant, rms=12.0)])
    assert "force z deviates by 12 N rms (expected 1.3 N)" in sentence and "it oscillates at 1.31 Hz" in sentence


def test_the_sentence_tells_what_rings_at_the_platform_alone() -> None:
    cables, wrong = [part("cable 1", "tension", 1.3)], [part("cable 1", "tension", 14.0)]
    platform = [part("platform", "force x", 9.0, 0.451), part("platform", "force z", 2.0, 0.9)]
    assert "oscillates at 0.45 Hz" in isolation_verdict(cables, platform)[1]
    assert "oscillates" not in isolation_verdict(wrong, platform)[1]
    in_question, sentence = isolation_verdict(cables, platform, hidden_candidates=["platform", "load cell 1"])
    assert in_question == "platform or load cell 1" and "oscillates at 0.45 Hz" in sentence


def test_where_nothing_was_looked_at_the_sentence_says_so() -> None:
    assert isolation_verdict((), ()) == ("cannot tell", "Cannot tell which component is faulty.")


def test_names_are_counted() -> None:
    assert [numbered("cable", [2]), numbered("exit point", [1, 3])] == ["cable 2", "exit points 1, 3"]


def localised(*tensions: float, force: float = 1.3) -> FaultLocalisation:
    """The localisation by rms of the tensions of cables 1, 2 and so on, and of a force; 1.3 is noise."""
    cables = [part(f"cable {number}", "tension", rms) for number, rms in enumerate(tensions, 1)]
    platform = [part("platform", "force x", force)]
    return FaultLocalisation(np.zeros(3), (*cables, *platform), *isolation_verdict(cables, platform), ())


def test_an_effect_of_all_cables_that_stands_out_at_one_puts_all_in_question() -> None:
    told = reconciled_with_effects(localised(1.2, 14.1), [("modulus", (1, 2))])
    assert told.faulty_component == "cables 1, 2, most of all cable 2"
    assert told.sentence == (
        "Cable 2's tension deviates by 14 N rms (expected 1.3 N); the platform's force balance closes as expected. "
        "In question: cables 1, 2, most of all cable 2; modulus acts on them and shows at none of the others alone."
    )


@pytest.mark.parametrize(
    ("localisation", "effects"),
    [(localised(1.2, 1.3), [("drum", (1,))]), (localised(1.2, 1.3, force=9.0), [("sensor_offset", (1,))])],
)
def test_an_effect_that_no_component_shows_is_told_by_all_outputs(
    localisation: FaultLocalisation, effects: list[tuple[str, tuple[int, ...]]]
) -> None:
    told = reconciled_with_effects(localisation, effects)
    assert told.sentence.startswith(localisation.sentence)
    assert f"{effects[0][0]} is told by all outputs together, not by one component." in told.sentence


@pytest.mark.parametrize("effects", [[], [("drum", (2,))]])
def test_what_agrees_with_the_effects_stays(effects: list[tuple[str, tuple[int, ...]]]) -> None:
    localisation = localised(1.2, 14.1)
    assert reconciled_with_effects(localisation, effects) == localisation
