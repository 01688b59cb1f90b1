"""Laws traced with CasADi symbols into C functions, with their domains and switches recorded.

C has no exceptions: the logarithm of a negative number is NaN, and a comparison with NaN picks one side. CasADi also
drops every logarithm on which no output depends. So the mathematics handed to a law records where each of its functions
is defined, and every traced function tells whether all of them were.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi
from casadi import SX

from tautwire_fmu.laws.mathematics import Mathematics

LARGEST_NUMBER = 1.7976931348623157e308
# Above it the exponential function overflows.
LARGEST_EXPONENT = 709.782712893384
VALID = "valid"
INDICATORS = "indicators"
CASADI_TYPES = "#define casadi_real double\n#define casadi_int int"

Columns = Mapping[str, Sequence[Any]]
Equations = Callable[[Mathematics, Columns], Columns]


@dataclass
class Recorder:
    """Conditions under which a law is defined, and the switches at whose zeros its derivative jumps."""

    conditions: list[SX] = field(default_factory=list)
    switches: list[SX] = field(default_factory=list)

    def require(self, condition: Any) -> None:
        """Record a condition; numbers that fulfil theirs are none."""
        if isinstance(condition, SX):
            self.conditions.append(condition)

    def require_finite(self, value: Any) -> None:
        """Record that a value, which a comparison could hide, is to be finite."""
        if isinstance(value, SX):
            self.conditions += [value <= LARGEST_NUMBER, value >= -LARGEST_NUMBER]

    def mathematics(self) -> Mathematics:
        """Mathematics on symbols that records; its branches are those of complex steps."""

        def log(a: Any) -> Any:
            self.require(a > 0.0)
            return casadi.log(a)

        def sqrt(a: Any) -> Any:
            self.require(a >= 0.0)
            return casadi.sqrt(a)

        def exp(a: Any) -> Any:
            self.require(a <= LARGEST_EXPONENT)
            return casadi.exp(a)

        def choose(switch: Any, is_first: Any, first: Any, second: Any) -> Any:
            self.require_finite(switch)
            if isinstance(switch, SX):
                self.switches.append(switch)
            return casadi.if_else(is_first, first, second)

        return Mathematics(
            log=log,
            exp=exp,
            sqrt=sqrt,
            sin=casadi.sin,
            cos=casadi.cos,
            tanh=casadi.tanh,
            atan2=casadi.atan2,
            absolute=lambda a: choose(a, a < 0.0, -a, a),
            maximum=lambda a, b: choose(a - b, a - b >= 0.0, a, b),
            where=lambda condition, a, b: choose(condition, condition > 0.0, a, b),
        )


@dataclass(frozen=True)
class TracedFunction:
    """C function of columns of numbers, by name and size; ``function`` has one more output, whether it is defined."""

    name: str
    inputs: Mapping[str, int]
    outputs: Mapping[str, int]
    function: casadi.Function


def trace_function(name: str, inputs: Mapping[str, int], equations: Equations) -> TracedFunction:
    """Trace ``equations``: from mathematics and the columns of its inputs to the columns of its outputs."""
    return _traced(name, inputs, lambda recorder, columns: equations(recorder.mathematics(), columns))


def _traced(name: str, inputs: Mapping[str, int], equations: Callable[[Recorder, Columns], Columns]) -> TracedFunction:
    recorder = Recorder()
    symbols = {each: SX.sym(each, size) for each, size in inputs.items()}
    columns = {each: casadi.vertsplit(symbol) if symbol.numel() else [] for each, symbol in symbols.items()}
    outputs = {each: column(values) for each, values in equations(recorder, columns).items()}
    valid = SX(1.0)
    for condition in recorder.conditions:
        valid = casadi.logic_and(valid, condition)
    function = casadi.Function(
        name,
        list(symbols.values()),
        [*outputs.values(), casadi.densify(valid)],
        list(inputs),
        [*outputs, VALID],
        {"cse": True},
    )
    return TracedFunction(name, dict(inputs), {each: value.numel() for each, value in outputs.items()}, function)


def column(values: Sequence[Any]) -> SX:
    """Dense column of symbols and numbers."""
    return casadi.densify(casadi.vertcat(*map(SX, values))) if values else SX(0, 1)


def rates_along(values: Sequence[Any], variables: Sequence[SX], rates: Sequence[Any]) -> list[SX]:
    """Rates of change of ``values`` where ``variables`` change at ``rates``: exact forward derivative."""
    derivative = casadi.jtimes(column(values), column(variables), column(rates))
    return casadi.vertsplit(casadi.densify(derivative))


def derivative_along(
    function: Callable[[Mathematics, list[SX]], Sequence[Any]], values: Sequence[Any], rates: Sequence[Any]
) -> list[SX]:
    """Rates of a function's results at ``values``, which need not be symbols, where these change at ``rates``."""
    symbols = SX.sym("value", len(values))
    results = column(function(Recorder().mathematics(), casadi.vertsplit(symbols)))
    derivative = casadi.jtimes(results, symbols, column(rates))
    return casadi.vertsplit(casadi.densify(casadi.substitute(derivative, symbols, column(values))))


def trace_derivative(
    name: str, inputs: Mapping[str, int], equations: Equations, varying: Sequence[str]
) -> TracedFunction:
    """Trace the directional derivative of ``equations`` along changes of the columns ``varying``.

    The changes are further inputs behind all others, each by the name of its column with ``_seed`` behind it.
    """
    seeds = {f"{each}_seed": inputs[each] for each in varying}

    def derivative(m: Mathematics, columns: Columns) -> Columns:
        outputs = equations(m, columns)
        variables, changes = ([entry for each in names for entry in columns[each]] for names in (varying, seeds))
        return {each: rates_along(values, variables, changes) for each, values in outputs.items()}

    return trace_function(name, {**inputs, **seeds}, derivative)


def trace_kinks(name: str, inputs: Mapping[str, int], equations: Equations, varying: Sequence[str]) -> TracedFunction:
    """Trace the ``indicators`` of ``equations``: numbers at whose zeros some output has a kink.

    They are the arguments of absolute values, maxima and branches, each once, that change with the columns ``varying``;
    those that the equations themselves give as ``indicators`` come first.
    """

    def indicators(recorder: Recorder, columns: Columns) -> Columns:
        first = equations(recorder.mathematics(), columns).get(INDICATORS, ())
        variables = column([entry for each in varying for entry in columns[each]])
        kinks = column([*first, *recorder.switches])
        switches = casadi.vertsplit(casadi.cse(kinks)) if kinks.numel() else []
        distinct = {each.element_hash(): each for each in switches if casadi.depends_on(each, variables)}
        return {INDICATORS: list(distinct.values())}

    return _traced(name, inputs, indicators)


def c_source(functions: Sequence[TracedFunction]) -> str:
    """C source of traced functions: of each a static one that returns whether all is defined, and every output finite.

    Its arguments are the columns of the inputs, then those of the outputs. It needs ``math.h`` and ``are_finite``.
    """
    generator = casadi.CodeGenerator("equations.c", {"casadi_int": "int"})
    for each in functions:
        generator.add(each.function)
    blocks = generator.dump().split("\n\n")
    helpers = [f"static {block}" for block in blocks if block.startswith("casadi_real casadi_")]
    bodies = [block for block in blocks if "\nstatic int casadi_f" in block]
    return "\n\n".join([CASADI_TYPES, *helpers, *bodies, *map(_wrapper, range(len(functions)), functions)]) + "\n"


def _wrapper(index: int, traced: TracedFunction) -> str:
    arguments = [*(f"const double *{name}" for name in traced.inputs), *(f"double *{name}" for name in traced.outputs)]
    finite = "".join(f" && are_finite({name}, {size})" for name, size in traced.outputs.items() if size)
    return f"""static int {traced.name}({", ".join(arguments)}) {{
  double valid;
  const double *arguments[] = {{{", ".join(traced.inputs)}}};
  double *results[] = {{{", ".join([*traced.outputs, "&valid"])}}};
  casadi_f{index}(arguments, results, 0, 0, 0);
  return valid > 0.0{finite};
}}"""
