"""CasADi functions over the samples of a recording as machine code.

With ten thousand instructions it is ten times as fast as CasADi's interpreter, and compiled in a tenth of a second;
with a hundred thousand four times as fast, and compiled in one. Optimising it would take longer than most fits do. Far
larger functions leave the processor's caches, and are interpreted. Constants are data, not code: functions that differ
in nothing else share theirs, which :mod:`tautwire.machine_code_cache` keeps on disk.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import casadi
import llvmlite
import llvmlite.binding as llvm
import numpy as np
from casadi import Function
from numpy.typing import NDArray

from ..machine_code_cache import cached_machine_code
from .llvm_assembly import llvm_assembly

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

    Raises :class:`tautwire.estimation.llvm_assembly.UntranslatableError`.
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
