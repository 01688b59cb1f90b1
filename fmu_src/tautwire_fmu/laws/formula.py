"""Formulas as effects: what no known effect is, written down as arithmetic of what the laws know.

``tension`` (N) is added in the rope, less what the formula gives at the start, where the tension is what statics asks
for; ``force_x``, ``force_y`` and ``force_z`` (N) push the platform, also at the start; ``mass`` (kg) is carried by it.
"""

from typing import Any, Dict, Mapping, NamedTuple, Sequence, Tuple

from .effects import Effect, State
from .expression import Node, evaluate, names_in, read_expression
from .mathematics import Mathematics
from .vectors import Vector

NAME = "formula"
IN_ROPE = ("strain", "strain_rate", "tension", "length", "winch_speed", "travel", "time")
ON_PLATFORM = ("x", "y", "z", "vx", "vy", "vz", "time")
FORCES = ("force_x", "force_y", "force_z")
# The names that a formula may use, by its place.
PLACES: Dict[str, Tuple[str, ...]] = {"tension": IN_ROPE, **dict.fromkeys(FORCES, ON_PLATFORM), "mass": ("time",)}

TRAVEL = State("travel", "m", "rope reeled in by the encoder since the start", drifts=True)
TIME = State("time", "s", "time since the start", drifts=True)


class Formulas(NamedTuple):
    """The trees of one component by place; those of one place add up."""

    trees: Mapping[str, Tuple[Node, ...]]

    def value(self, m: Mathematics, place: str, values: Mapping[str, Any]) -> Any:
        """The sum in a place, in its unit."""
        total: Any = 0.0
        for tree in self.trees.get(place, ()):
            total = total + evaluate(m, tree, values)
        return total


def formula_effect(texts: Mapping[str, Sequence[str]], numbers: Sequence[str] = ()) -> Effect:
    """The effect of some formulas, by place, in one rope or on the platform.

    They may use ``numbers`` beside the names of their place: the effect's ``values`` are these, by name.

    Raises ExpressionError where a text is no formula.
    """
    trees = {
        place: tuple(read_expression(text, (*PLACES[place], *numbers)) for text in given)
        for place, given in texts.items()
    }
    formulas = Formulas(trees)
    used = {name for given in trees.values() for tree in given for name in names_in(tree)}
    states = tuple(state for state in (TRAVEL, TIME) if state.name in used)
    names = [state.name for state in states]

    def tension(m: Mathematics, values: Mapping[str, Any], own: Tuple[Any, ...], cable: Any, motion: Any) -> Any:
        length = motion.line.length
        now = _in_rope(motion.strain, motion.strain_rate, motion.elastic_tension, length, motion.winch_speed)
        begun = _in_rope(0.0, 0.0, cable.start_tension, cable.start_length, 0.0)
        moved = formulas.value(m, "tension", {**values, **now, **dict(zip(names, own))})
        return moved - formulas.value(m, "tension", {**values, **begun, **dict.fromkeys(names, 0.0)})

    def state_rates(
        m: Mathematics, values: Mapping[str, Any], own: Tuple[Any, ...], cable: Any, motion: Any
    ) -> Tuple[Any, ...]:
        return tuple(motion.winch_speed if name == TRAVEL.name else 1.0 for name in names)

    def wrench(
        m: Mathematics, values: Mapping[str, Any], own: Tuple[Any, ...], position: Vector, velocity: Vector
    ) -> Vector:
        known = dict(zip(ON_PLATFORM, (*position, *velocity)))
        now = {**values, **known, **dict(zip(names, own))}
        return tuple(formulas.value(m, place, now) for place in FORCES)

    def inertia(m: Mathematics, values: Mapping[str, Any], own: Tuple[Any, ...]) -> Any:
        return formulas.value(m, "mass", {**values, **dict(zip(names, own))})

    in_rope = "tension" in trees
    return Effect(
        name=NAME,
        component="cable" if in_rope else "platform",
        description="a formula that explains what no known effect does",
        parameters=(),
        values=dict,
        source="found on recordings of this robot",
        states=states,
        state_rates=state_rates if in_rope else None,
        tension=tension if in_rope else None,
        wrench=wrench if any(place in trees for place in FORCES) else None,
        inertia=inertia if "mass" in trees else None,
    )


def _in_rope(*values: Any) -> Dict[str, Any]:
    return dict(zip(IN_ROPE, values))
