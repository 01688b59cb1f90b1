"""A CasADi function over the samples of a recording, in machine code that LLVM writes: no compiler need be installed.

With ten thousand instructions it is ten times as fast as CasADi's interpreter, and written in a tenth of a second; with
a hundred thousand four times as fast, and written in one. Optimising it would take longer than most fits do. Far larger
functions leave the processor's caches, and are interpreted.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import cache

import casadi
import llvmlite.binding as llvm
import numpy as np
from casadi import Function
from numpy.typing import NDArray

from .assembly import assembly

Array = NDArray[np.float64]

RUN = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p)
# Instructions beyond which CasADi's interpreter is faster.
MOST_WRITTEN = 800_000


class Repeated:
    """A function over K samples, whose first ``carried`` arguments are its first results of the sample before.

    Raises :class:`tautwire.native.assembly.UntranslatableError`.
    """

    def __init__(self, function: Function, carried: int = 0, most_written: int = MOST_WRITTEN) -> None:
        self._function = dense = _dense(function)
        self._carried = carried
        self._arguments = [dense.size_in(index) for index in range(dense.n_in())]
        self._results = [dense.size_out(index) for index in range(dense.n_out())]
        if self._arguments[:carried] != self._results[:carried]:
            raise ValueError(f"{carried} results of {function.name()} are to be carried: not as its first arguments")
        self._room = dense.sz_w()
        self._written = dense.n_instructions() <= most_written
        if self._written:
            # The machine code lives as long as its engine.
            self._engine = _engine(assembly(dense))
            self._run = RUN(self._engine.get_function_address("run"))

    def __call__(self, count: int, *arguments: Array) -> list[Array]:
        """Results (rows, columns x count), of each carried one (rows, columns x (count + 1)), beginning as given.

        Arguments are (rows, columns x count), or (rows, columns) where they are carried or the same for all samples.
        """
        carried = self._carried
        sizes = zip(arguments, self._arguments, strict=True)
        given = [_laid_out(argument, size, 1 if k < carried else count) for k, (argument, size) in enumerate(sizes)]
        if not self._written:
            return self._interpreted(count, given)
        results = [
            np.empty((rows, columns * (count + (number < carried))), order="F")
            for number, (rows, columns) in enumerate(self._results)
        ]
        for result, first in zip(results, given[:carried], strict=False):
            result[:, : first.shape[1]] = first
        read = [*results[:carried], *given[carried:]]
        moved = [
            rows * columns if k < carried or array.shape[1] != columns else 0
            for k, (array, (rows, columns)) in enumerate(zip(read, self._arguments, strict=True))
        ]
        written = [rows * columns for rows, columns in self._results]
        later = [size * array.itemsize for size, array in zip(written[:carried], results, strict=False)]
        later += [0] * (len(results) - carried)
        room = np.empty(self._room)
        places = [
            *(array.ctypes.data for array in read),
            *(array.ctypes.data + offset for array, offset in zip(results, later, strict=True)),
            room.ctypes.data,
        ]
        strides = [*moved, *written, 0]
        self._run(count, (ctypes.c_void_p * len(places))(*places), (ctypes.c_int64 * len(strides))(*strides))
        return results

    def _interpreted(self, count: int, given: Sequence[Array]) -> list[Array]:
        """By CasADi."""
        carried, function = self._carried, self._function
        if count == 0:
            empty = [np.empty((rows, 0)) for rows, _ in self._results[carried:]]
            return [*given[:carried], *empty]
        wide = [
            array if k < carried or array.shape[1] != columns else np.tile(array, count)
            for k, (array, (_, columns)) in enumerate(zip(given, self._arguments, strict=True))
        ]
        many = function.mapaccum("run", count, carried) if carried else function.map(count)
        found = [np.array(result) for result in many.call(wide)]
        return [*(np.hstack(pair) for pair in zip(given[:carried], found, strict=False)), *found[carried:]]


def stacked(wide: Array, count: int) -> Array:
    """A result (rows, columns x K) as (K, rows, columns)."""
    by_sample: Array = wide.reshape((wide.shape[0], wide.shape[1] // count, count), order="F").transpose(2, 0, 1)
    return by_sample


def _laid_out(argument: Array, size: Sequence[int], count: int) -> Array:
    """An argument column after column, of one sample or of all."""
    rows, columns = size
    array = np.asfortranarray(argument, dtype=float)
    if array.shape not in ((rows, columns * count), (rows, columns)):
        raise ValueError(f"an argument of shape {array.shape}, where {(rows, columns)} is one of {count} samples")
    return array


def _dense(function: Function) -> Function:
    """The same without structural zeros in what it takes and gives, so that every number has a place."""
    arguments = [casadi.SX.sym(f"a{index}", *function.size_in(index)) for index in range(function.n_in())]
    results = function.call(arguments)
    return Function(function.name(), arguments, [casadi.densify(result) for result in results])


def _engine(text: str) -> llvm.ExecutionEngine:
    """The assembly as machine code. LLVM's own form of it is some thirty times as large, and let go at once."""
    processor, features = _processor()
    machine = llvm.Target.from_default_triple().create_target_machine(opt=0, cpu=processor, features=features)
    # Constants would stay in the global context.
    with llvm.parse_assembly(text, llvm.create_context()) as module:
        code = machine.emit_object(module)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


@cache
def _processor() -> tuple[str, str]:
    """Name and features of the one at hand, made ready for."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
