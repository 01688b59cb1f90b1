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
    """Expression trees of one component by target, and the names of the states that they use.

    Its methods but :meth:`value` are stages of an effect whose ``values`` are the coefficients by name.
    """

    trees: Mapping[str, Tuple[ExpressionNode, ...]]
    state_names: Tuple[str, ...]

    def value(self, m: Mathematics, target: str, values: Mapping[str, Any]) -> Any:
        """Sum of the formulas of a target, in its unit."""
        total: Any = 0.0
        for tree in self.trees.get(target, ()):
            total = total + evaluate(m, tree, values)
        return total

    def tension(
        self, m: Mathematics, values: Mapping[str, Any], states: Tuple[Any, ...], cable: Any, motion: Any
    ) -> Any:
        """Tension added in the rope, less that at the start, in N."""
        present_values = _cable_values(
            motion.strain, motion.strain_rate, motion.elastic_tension, motion.line.length, motion.winch_speed
        )
        start_values = _cable_values(0.0, 0.0, cable.start_tension, cable.start_length, 0.0)
        present_tension = self.value(m, "tension", {**values, **present_values, **dict(zip(self.state_names, states))})
        return present_tension - self.value(
            m, "tension", {**values, **start_values, **dict.fromkeys(self.state_names, 0.0)}
        )

    def state_rates(
        self, m: Mathematics, values: Mapping[str, Any], states: Tuple[Any, ...], cable: Any, motion: Any
    ) -> Tuple[Any, ...]:
        """Rates of the states in a rope: the encoder's speed, and one."""
        return tuple(motion.winch_speed if name == ENCODER_TRAVEL.name else 1.0 for name in self.state_names)

    def wrench(
        self, m: Mathematics, values: Mapping[str, Any], states: Tuple[Any, ...], position: Vector, velocity: Vector
    ) -> Vector:
        """Force on the platform, in N."""
        motion_values = dict(zip(PLATFORM_VARIABLES, (*position, *velocity)))
        present_values = {**values, **motion_values, **dict(zip(self.state_names, states))}
        return tuple(self.value(m, target, present_values) for target in FORCE_TARGETS)

    def inertia(self, m: Mathematics, values: Mapping[str, Any], states: Tuple[Any, ...]) -> Any:
        """Mass carried by the platform, in kg."""
        return self.value(m, "mass", {**values, **dict(zip(self.state_names, states))})


def formula_effect(texts: Mapping[str, Sequence[str]], coefficient_names: Sequence[str] = ()) -> Effect:
    """Effect of some formulas, by target, in one rope or on the platform.

    They may use ``coefficient_names`` beside the variables of their target: the effect's ``values`` are these, by name.

    Raises ExpressionError where a text is no formula.
    """
    trees = {
        target: tuple(parse_expression(text, (*VARIABLES_BY_TARGET[target], *coefficient_names)) for text in given)
        for target, given in texts.items()
    }
    used_names = {name for given in trees.values() for tree in given for name in variable_names(tree)}
    states = tuple(state for state in (ENCODER_TRAVEL, ELAPSED_TIME) if state.name in used_names)
    formulas = Formulas(trees, tuple(state.name for state in states))
    acts_in_cable = "tension" in trees
    return Effect(
        name=FORMULA_EFFECT_NAME,
        component="cable" if acts_in_cable else "platform",
        description="a formula that explains what no known effect does",
        parameters=(),
        values=dict,
        source="found on recordings of this robot",
        states=states,
        state_rates=formulas.state_rates if acts_in_cable else None,
        tension=formulas.tension if acts_in_cable else None,
        wrench=formulas.wrench if any(target in trees for target in FORCE_TARGETS) else None,
        inertia=formulas.inertia if "mass" in trees else None,
    )


def _cable_values(*values: Any) -> Dict[str, Any]:
    return dict(zip(CABLE_VARIABLES, values))
