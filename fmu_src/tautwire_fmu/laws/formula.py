"""Formula effects: arithmetic expressions for what no known effect explains.

Targets: ``tension`` (N) is added in the rope, less its value at the start, where the tension is the static one;
``force_x``, ``force_y`` and ``force_z`` (N) act on the platform, also at the start; ``mass`` (kg) is carried by it.
"""

from typing import Any, Dict, Mapping, NamedTuple, Sequence, Tuple

from .effects import Effect, State
from .expression import ExpressionNode, evaluate, parse_expression, variable_names
from .mathematics import Mathematics
from .vectors import Vector

FORMULA_EFFECT_NAME = "formula"
CABLE_VARIABLES = ("strain", "strain_rate", "tension", "length", "winch_speed", "travel", "time")
PLATFORM_VARIABLES = ("x", "y", "z", "vx", "vy", "vz", "time")
FORCE_TARGETS = ("force_x", "force_y", "force_z")
# Variables that a formula may use, by its target: the quantity that it adds to.
VARIABLES_BY_TARGET: Dict[str, Tuple[str, ...]] = {
    "tension": CABLE_VARIABLES,
    **dict.fromkeys(FORCE_TARGETS, PLATFORM_VARIABLES),
    "mass": ("time",),
}

ENCODER_TRAVEL = State("travel", "m", "rope reeled in by the encoder since the start", drifts=True)
ELAPSED_TIME = State("time", "s", "time since the start", drifts=True)


class Formulas(NamedTuple):
    """Expression trees of one component by target; those of one target add up."""

    trees: Mapping[str, Tuple[ExpressionNode, ...]]

    def value(self, m: Mathematics, target: str, values: Mapping[str, Any]) -> Any:
        """Sum of the formulas of a target, in its unit."""
        total: Any = 0.0
        for tree in self.trees.get(target, ()):
            total = total + evaluate(m, tree, values)
        return total


def formula_effect(texts: Mapping[str, Sequence[str]], coefficient_names: Sequence[str] = ()) -> Effect:
    """Effect of some formulas, by target, in one rope or on the platform.

    They may use ``coefficient_names`` beside the variables of their target: the effect's ``values`` are these, by name.

    Raises ExpressionError where a text is no formula.
    """
    trees = {
        place: tuple(parse_expression(text, (*VARIABLES_BY_TARGET[place], *coefficient_names)) for text in given)
        for place, given in texts.items()
    }
    formulas = Formulas(trees)
    used_names = {name for given in trees.values() for tree in given for name in variable_names(tree)}
    states = tuple(state for state in (ENCODER_TRAVEL, ELAPSED_TIME) if state.name in used_names)
    state_names = [state.name for state in states]

    def tension(
        m: Mathematics, values: Mapping[str, Any], effect_states: Tuple[Any, ...], cable: Any, motion: Any
    ) -> Any:
        length = motion.line.length
        present_values = _cable_values(
            motion.strain, motion.strain_rate, motion.elastic_tension, length, motion.winch_speed
        )
        start_values = _cable_values(0.0, 0.0, cable.start_tension, cable.start_length, 0.0)
        present_tension = formulas.value(
            m, "tension", {**values, **present_values, **dict(zip(state_names, effect_states))}
        )
        return present_tension - formulas.value(
            m, "tension", {**values, **start_values, **dict.fromkeys(state_names, 0.0)}
        )

    def state_rates(
        m: Mathematics, values: Mapping[str, Any], effect_states: Tuple[Any, ...], cable: Any, motion: Any
    ) -> Tuple[Any, ...]:
        return tuple(motion.winch_speed if name == ENCODER_TRAVEL.name else 1.0 for name in state_names)

    def wrench(
        m: Mathematics, values: Mapping[str, Any], effect_states: Tuple[Any, ...], position: Vector, velocity: Vector
    ) -> Vector:
        motion_values = dict(zip(PLATFORM_VARIABLES, (*position, *velocity)))
        present_values = {**values, **motion_values, **dict(zip(state_names, effect_states))}
        return tuple(formulas.value(m, place, present_values) for place in FORCE_TARGETS)

    def inertia(m: Mathematics, values: Mapping[str, Any], effect_states: Tuple[Any, ...]) -> Any:
        return formulas.value(m, "mass", {**values, **dict(zip(state_names, effect_states))})

    acts_in_cable = "tension" in trees
    return Effect(
        name=FORMULA_EFFECT_NAME,
        component="cable" if acts_in_cable else "platform",
        description="a formula that explains what no known effect does",
        parameters=(),
        values=dict,
        source="found on recordings of this robot",
        states=states,
        state_rates=state_rates if acts_in_cable else None,
        tension=tension if acts_in_cable else None,
        wrench=wrench if any(place in trees for place in FORCE_TARGETS) else None,
        inertia=inertia if "mass" in trees else None,
    )


def _cable_values(*values: Any) -> Dict[str, Any]:
    return dict(zip(CABLE_VARIABLES, values))
