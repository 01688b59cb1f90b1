"""A CasADi function over the samples of a recording, in machine code that LLVM writes: no compiler need be installed.

Some ten times faster than CasADi's interpreter, and written in a tenth of a second. Optimising it would take longer
than most fits do.
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


class Repeated:
    """A function over K samples, whose first ``carried`` arguments are its first results of the sample before.

    Raises :class:`tautwire.native.assembly.UntranslatableError`.
    """

    def __init__(self, function: Function, carried: int = 0) -> None:
        dense = _dense(function)
        self._carried = carried
        self._arguments = [dense.size_in(index) for index in range(dense.n_in())]
        self._results = [dense.size_out(index) for index in range(dense.n_out())]
        self._room = dense.sz_w()
        # The machine code lives as long as its engine.
        self._engine = _engine(assembly(dense))
        self._run = RUN(self._engine.get_function_address("run"))

    def __call__(self, count: int, *arguments: Array) -> list[Array]:
        """Results (rows, columns x count), of each carried one (rows, columns x (count + 1)), beginning as given.

        Arguments are (rows, columns x count), or (rows, columns) where they are carried or the same for all samples.
        """
        carried = self._carried
        results = [
            np.empty((rows, columns * (count + (number < carried))), order="F")
            for number, (rows, columns) in enumerate(self._results)
        ]
        for result, first, (_, columns) in zip(results, arguments[:carried], self._results, strict=False):
            result[:, :columns] = first
        sizes = [rows * columns for rows, columns in self._results]
        given = [
            _every_sample(argument, size, count)
            for argument, size in zip(arguments[carried:], self._arguments[carried:], strict=True)
        ]
        later = [size * result.itemsize for size, result in zip(sizes[:carried], results, strict=False)]
        later += [0] * (len(results) - carried)
        room = np.empty(self._room)
        places = [
            *(result.ctypes.data for result in results[:carried]),
            *(array.ctypes.data for array, _ in given),
            *(result.ctypes.data + offset for result, offset in zip(results, later, strict=True)),
            room.ctypes.data,
        ]
        strides = [*sizes[:carried], *(stride for _, stride in given), *sizes, 0]
        self._run(count, (ctypes.c_void_p * len(places))(*places), (ctypes.c_int64 * len(strides))(*strides))
        return results


def stacked(wide: Array, count: int) -> Array:
    """A result (rows, columns x K) as (K, rows, columns)."""
    by_sample: Array = wide.reshape((wide.shape[0], wide.shape[1] // count, count), order="F").transpose(2, 0, 1)
    return by_sample


def _every_sample(argument: Array, size: Sequence[int], count: int) -> tuple[Array, int]:
    """An argument column after column, and how many numbers further the next sample's begins."""
    rows, columns = size
    array = np.asfortranarray(argument, dtype=float)
    if array.shape == (rows, columns * count):
        return array, rows * columns
    if array.shape == (rows, columns):
        return array, 0
    raise ValueError(f"an argument of shape {array.shape}, where {(rows, columns)} is one of {count} samples")


def _dense(function: Function) -> Function:
    """The same without structural zeros in what it takes and gives, so that every number has a place."""
    arguments = [casadi.SX.sym(f"a{index}", *function.size_in(index)) for index in range(function.n_in())]
    results = function.call(arguments)
    return Function(function.name(), arguments, [casadi.densify(result) for result in results])


def _engine(text: str) -> llvm.ExecutionEngine:
    """The assembly as machine code. LLVM's own form of it is some thirty times as large, and let go at once."""
    processor, features = _processor()
    machine = llvm.Target.from_default_triple().create_target_machine(opt=0, cpu=processor, features=features)
    with llvm.parse_assembly(text) as module:
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
