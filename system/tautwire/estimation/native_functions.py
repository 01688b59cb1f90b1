"""CasADi functions over the samples of a recording as machine code, through LLVM assembly.

Within a part each value is named where it is computed and never changes; only what other parts need goes through
CasADi's work vector. In one part, large functions would take LLVM long and need more stack than a thread has.

Source: LLVM Language Reference Manual; Andersson et al. (2019), CasADi, Mathematical Programming Computation 11, 1-36.

With ten thousand instructions it is ten times as fast as CasADi's interpreter, and compiled in a tenth of a second;
with a hundred thousand four times as fast, and compiled in one. Optimising it would take longer than most fits do. Far
larger functions leave the processor's caches, and are interpreted. Constants are data, not code: functions that differ
in nothing else share theirs, which :mod:`tautwire.machine_code_cache` keeps on disk.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import casadi
import llvmlite
import llvmlite.binding as llvm
import numpy as np
from casadi import Function
from numpy.typing import NDArray

from ..errors import TautwireError
from ..machine_code_cache import cached_machine_code

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


Array = NDArray[np.float64]

RUN_PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p)
# Instructions beyond which CasADi's interpreter is faster.
MAX_COMPILED_INSTRUCTIONS = 800_000


@dataclass(frozen=True)
class BoundFunction:
    """A compiled function bound to arguments of K samples and results of one: what ``run`` at its address takes.

    ``places`` are addresses of the first sample's numbers, ``strides`` how many numbers each moves from one sample to
    the next. ``results`` (columns, rows) are those of the sample that was evaluated last. What the addresses belong
    to is ``owners``: it has to live as long.
    """

    address: int
    places: NDArray[np.int64]
    strides: NDArray[np.int64]
    results: tuple[Array, ...]
    owners: tuple[object, ...]


class CompiledFunction:
    """Compiled function over K samples; its first ``carried`` arguments are its first results of the sample before.

    Raises :class:`tautwire.estimation.native_functions.UntranslatableError`.
    """

    def __init__(self, function: Function, carried: int = 0, max_compiled: int = MAX_COMPILED_INSTRUCTIONS) -> None:
        dense = _dense(function)
        self._carried = carried
        self._argument_shapes = [dense.size_in(index) for index in range(dense.n_in())]
        self._result_shapes = [dense.size_out(index) for index in range(dense.n_out())]
        if self._argument_shapes[:carried] != self._result_shapes[:carried]:
            raise ValueError(f"{carried} results of {function.name()} are to be carried: not as its first arguments")
        self._workspace_size = dense.sz_w()
        self.instruction_count = dense.n_instructions()
        self._interpreted_function = None if self.instruction_count <= max_compiled else dense
        if self._interpreted_function is None:
            # The machine code lives as long as its engine.
            text, constants = llvm_assembly(dense)
            self._engine = _engine(text)
            self._constants = np.array(constants)
            self._native_run = RUN_PROTOTYPE(self._engine.get_function_address("run"))

    def __call__(self, count: int, *arguments: Array) -> list[Array]:
        """Results (rows, columns x count); of each carried one (rows, columns x (count + 1)), with its first argument.

        Arguments are (rows, columns x count), or (rows, columns) where they are carried or the same for all samples.
        """
        carried = self._carried
        sizes = zip(arguments, self._argument_shapes, strict=True)
        inputs = [
            _column_major(argument, size, 1 if k < carried else count) for k, (argument, size) in enumerate(sizes)
        ]
        if self._interpreted_function is not None:
            return self._interpreted(self._interpreted_function, count, inputs)
        results = [
            np.empty((rows, columns * (count + (number < carried))), order="F")
            for number, (rows, columns) in enumerate(self._result_shapes)
        ]
        for result, first in zip(results, inputs[:carried], strict=False):
            result[:, : first.shape[1]] = first
        sources = [*results[:carried], *inputs[carried:]]
        result_sizes = [rows * columns for rows, columns in self._result_shapes]
        result_offsets = [size * array.itemsize for size, array in zip(result_sizes[:carried], results, strict=False)]
        result_offsets += [0] * (len(results) - carried)
        workspace = np.empty(self._workspace_size)
        pointers = [
            *(array.ctypes.data for array in sources),
            *(array.ctypes.data + offset for array, offset in zip(results, result_offsets, strict=True)),
            self._constants.ctypes.data,
            workspace.ctypes.data,
        ]
        strides = [*self._argument_strides(sources), *result_sizes, 0, 0]
        places = (ctypes.c_void_p * len(pointers))(*pointers)
        self._native_run(0, count, places, (ctypes.c_int64 * len(strides))(*strides))
        return results

    def bind(self, count: int, *arguments: Array) -> BoundFunction:
        """Bind the function to arguments as for a call."""
        inputs = [
            _column_major(argument, size, count)
            for argument, size in zip(arguments, self._argument_shapes, strict=True)
        ]
        results = [np.empty((columns, rows)) for rows, columns in self._result_shapes]
        arrays = (*inputs, *results, self._constants, np.empty(self._workspace_size))
        strides = [*self._argument_strides(inputs), *[0] * (len(arrays) - len(inputs))]
        places = np.array([array.ctypes.data for array in arrays], dtype=np.int64)
        address = self._engine.get_function_address("run")
        return BoundFunction(address, places, np.array(strides, dtype=np.int64), tuple(results), (self, *arrays))

    def _argument_strides(self, arrays: Sequence[Array]) -> list[int]:
        """By how many numbers each argument moves from one sample to the next."""
        return [
            rows * columns if k < self._carried or array.shape[1] != columns else 0
            for k, (array, (rows, columns)) in enumerate(zip(arrays, self._argument_shapes, strict=True))
        ]

    def _interpreted(self, function: Function, count: int, inputs: Sequence[Array]) -> list[Array]:
        """Evaluate with CasADi's interpreter."""
        carried = self._carried
        if count == 0:
            empty = [np.empty((rows, 0)) for rows, _ in self._result_shapes[carried:]]
            return [*inputs[:carried], *empty]
        tiled = [
            array if k < carried or array.shape[1] != columns else np.tile(array, count)
            for k, (array, (_, columns)) in enumerate(zip(inputs, self._argument_shapes, strict=True))
        ]
        mapped = function.mapaccum("run", count, carried) if carried else function.map(count)
        mapped_results = [np.array(result) for result in mapped.call(tiled)]
        return [
            *(np.hstack(pair) for pair in zip(inputs[:carried], mapped_results, strict=False)),
            *mapped_results[carried:],
        ]


def by_sample(wide: Array, count: int) -> Array:
    """A result (rows, columns x K) as (K, rows, columns)."""
    samples_first: Array = wide.reshape((wide.shape[0], wide.shape[1] // count, count), order="F").transpose(2, 0, 1)
    return samples_first


def _column_major(argument: Array, size: Sequence[int], count: int) -> Array:
    """An argument in column-major order, of one sample or of all."""
    rows, columns = size
    array = np.asfortranarray(argument, dtype=float)
    if array.shape not in ((rows, columns * count), (rows, columns)):
        raise ValueError(f"an argument of shape {array.shape}, where {(rows, columns)} is one of {count} samples")
    return array


def _dense(function: Function) -> Function:
    """The same function with dense arguments and results, so that every number has an address."""
    arguments = [casadi.SX.sym(f"a{index}", *function.size_in(index)) for index in range(function.n_in())]
    results = function.call(arguments)
    return Function(function.name(), arguments, [casadi.densify(result) for result in results])


def _engine(text: str) -> llvm.ExecutionEngine:
    """The assembly as machine code. LLVM's own form of it is some thirty times as large, and freed at once."""
    processor, features = _processor()
    machine = llvm.Target.from_default_triple().create_target_machine(opt=0, cpu=processor, features=features)

    def compile_text() -> bytes:
        # Constants would stay in the global context.
        with llvm.parse_assembly(text, llvm.create_context()) as module:
            return bytes(machine.emit_object(module))

    versions = [llvmlite.__version__, ".".join(map(str, llvm.llvm_version_info)), machine.triple, processor, features]
    code = cached_machine_code("\n".join([*versions, text]).encode(), compile_text)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


@cache
def _processor() -> tuple[str, str]:
    """Name and features of this machine's processor, after initialising LLVM for it."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
