"""LLVM assembly of CasADi functions over the samples of a recording.

Within a part each value is named where it is computed and never changes; only what other parts need goes through
CasADi's work vector. In one part, large functions would take LLVM long and need more stack than a thread has.

Source: LLVM Language Reference Manual; Andersson et al. (2019), CasADi, Mathematical Programming Computation 11, 1-36.
"""

from __future__ import annotations

from collections.abc import Iterator

import casadi
from casadi import Function

from ..errors import TautwireError

# Instructions of one part.
MAX_PART_INSTRUCTIONS = 4_000
# Operations that call a function, mostly of C's mathematics library: its name and number of arguments.
LIBRARY_CALLS = {
    casadi.OP_EXP: ("exp", 1),
    casadi.OP_LOG: ("log", 1),
    casadi.OP_POW: ("pow", 2),
    casadi.OP_CONSTPOW: ("pow", 2),
    casadi.OP_SQRT: ("llvm.sqrt.f64", 1),
    casadi.OP_SIN: ("sin", 1),
    casadi.OP_COS: ("cos", 1),
    casadi.OP_TAN: ("tan", 1),
    casadi.OP_ASIN: ("asin", 1),
    casadi.OP_ACOS: ("acos", 1),
    casadi.OP_ATAN: ("atan", 1),
    casadi.OP_ATAN2: ("atan2", 2),
    casadi.OP_SINH: ("sinh", 1),
    casadi.OP_COSH: ("cosh", 1),
    casadi.OP_TANH: ("tanh", 1),
    casadi.OP_FABS: ("llvm.fabs.f64", 1),
    casadi.OP_FMIN: ("fmin", 2),
    casadi.OP_FMAX: ("fmax", 2),
}
# {v} is the name of the result, {0} and {1} are those of the operands.
INSTRUCTIONS = {
    casadi.OP_ASSIGN: "{v} = fadd double {0}, -0.0",
    casadi.OP_ADD: "{v} = fadd double {0}, {1}",
    casadi.OP_SUB: "{v} = fsub double {0}, {1}",
    casadi.OP_MUL: "{v} = fmul double {0}, {1}",
    casadi.OP_DIV: "{v} = fdiv double {0}, {1}",
    casadi.OP_NEG: "{v} = fneg double {0}",
    casadi.OP_SQ: "{v} = fmul double {0}, {0}",
    casadi.OP_TWICE: "{v} = fadd double {0}, {0}",
    casadi.OP_INV: "{v} = fdiv double 1.0, {0}",
    casadi.OP_LT: "{v}c = fcmp olt double {0}, {1}\n{v} = uitofp i1 {v}c to double",
    casadi.OP_LE: "{v}c = fcmp ole double {0}, {1}\n{v} = uitofp i1 {v}c to double",
    casadi.OP_EQ: "{v}c = fcmp oeq double {0}, {1}\n{v} = uitofp i1 {v}c to double",
    casadi.OP_NE: "{v}c = fcmp une double {0}, {1}\n{v} = uitofp i1 {v}c to double",
    casadi.OP_NOT: "{v}c = fcmp oeq double {0}, 0.0\n{v} = uitofp i1 {v}c to double",
    casadi.OP_IF_ELSE_ZERO: "{v}c = fcmp une double {0}, 0.0\n{v} = select i1 {v}c, double {1}, double 0.0",
    casadi.OP_SIGN: (
        "{v}a = fcmp olt double {0}, 0.0\n{v}b = fcmp ogt double {0}, 0.0\n"
        "{v}c = select i1 {v}b, double 1.0, double {0}\n{v} = select i1 {v}a, double -1.0, double {v}c"
    ),
}
RUN_TEMPLATE = """define void @run(i64 %first, i64 %count, ptr %places, ptr %strides) {{
begin:
%last = add i64 %first, %count
%any = icmp ult i64 %first, %last
br i1 %any, label %each, label %end
each:
%k = phi i64 [%first, %begin], [%next, %each]
{places}
{calls}
%next = add i64 %k, 1
%more = icmp ult i64 %next, %last
br i1 %more, label %each, label %end
end:
ret void
}}"""
POINTER_TEMPLATE = """%place{0} = getelementptr ptr, ptr %places, i64 {0}
%first{0} = load ptr, ptr %place{0}
%stride{0} = getelementptr i64, ptr %strides, i64 {0}
%size{0} = load i64, ptr %stride{0}
%moved{0} = mul i64 %size{0}, %k
%at{0} = getelementptr double, ptr %first{0}, i64 %moved{0}"""


class UntranslatableError(TautwireError):
    """A function has an operation that is not in the tables here; carries the function's name and CasADi's number."""

    def __init__(self, function: str, operation: int) -> None:
        self.function, self.operation = function, operation
        super().__init__(f"function {function}: CasADi's operation {operation} has no assembly; write it in this table")


def llvm_assembly(function: Function) -> tuple[str, list[float]]:
    """LLVM assembly that defines ``run(first, count, places, strides)``: the function, ``count`` times; and constants.

    ``first`` is the number of the first time, of which zero is where ``places`` point to: to the first number of each
    argument, then of each result, to the constants, and to room for ``function.sz_w()`` numbers; ``strides`` tell by
    how many numbers each moves from one time to the next. Arguments and results are dense, column after column.

    Raises UntranslatableError.
    """
    pointers = range(function.n_in() + function.n_out() + 2)
    declarations = [
        f"declare double @{name}({', '.join(['double'] * n)})" for name, n in sorted(set(LIBRARY_CALLS.values()))
    ]
    parts = range(0, function.n_instructions(), MAX_PART_INSTRUCTIONS)
    arguments = ", ".join(f"ptr %at{j}" for j in pointers)
    run_definition = RUN_TEMPLATE.format(
        places="\n".join(POINTER_TEMPLATE.format(j) for j in pointers),
        calls="\n".join(f"call void @part{first}({arguments})" for first in parts),
    )
    constants: list[float] = []
    definitions = [line for first in parts for line in _part_assembly(function, first, constants)]
    return "\n".join([*declarations, *definitions, run_definition]), constants


def _part_assembly(function: Function, first: int, constants: list[float]) -> Iterator[str]:
    """Assembly of one part, whose constants are appended; parts exchange values through the workspace."""
    pointers = [f"%p{j}" for j in range(function.n_in() + function.n_out() + 2)]
    *_, constant_table, workspace = pointers
    values: dict[int, str] = {}
    written: list[int] = []
    yield f"define void @part{first}({', '.join(f'ptr {name}' for name in pointers)}) {{"
    for k in range(first, min(first + MAX_PART_INSTRUCTIONS, function.n_instructions())):
        operation, name = function.instruction_id(k), f"%v{k}"
        sources, targets = function.instruction_input(k), function.instruction_output(k)
        if operation == casadi.OP_INPUT:
            yield _load(name, pointers[sources[0]], sources[1])
        elif operation == casadi.OP_CONST:
            yield _load(name, constant_table, len(constants))
            constants.append(function.instruction_constant(k))
        else:
            for index in sources:
                if index not in values:
                    values[index] = f"%w{k}_{index}"
                    yield _load(values[index], workspace, index)
            operands = [values[index] for index in sources]
            if operation == casadi.OP_OUTPUT:
                yield _store(operands[0], name, pointers[function.n_in() + targets[0]], targets[1])
                continue
            yield _operation(function, operation, name, operands)
        values[targets[0]] = name
        written.append(targets[0])
    for index in dict.fromkeys(written):
        yield _store(values[index], f"%s{index}", workspace, index)
    yield "ret void\n}"


def _load(name: str, pointer: str, index: int) -> str:
    return f"{name}a = getelementptr double, ptr {pointer}, i64 {index}\n{name} = load double, ptr {name}a"


def _store(value: str, name: str, pointer: str, index: int) -> str:
    return f"{name}a = getelementptr double, ptr {pointer}, i64 {index}\nstore double {value}, ptr {name}a"


def _operation(function: Function, operation: int, name: str, sources: list[str]) -> str:
    if operation in INSTRUCTIONS:
        return INSTRUCTIONS[operation].format(*sources, v=name)
    if operation in LIBRARY_CALLS:
        function_name, _ = LIBRARY_CALLS[operation]
        return f"{name} = call double @{function_name}({', '.join(f'double {source}' for source in sources)})"
    raise UntranslatableError(function.name(), operation)
