"""How the renderer's inner loops are compiled: by numba, to the same figures on every machine.

No `fastmath`, and no functions of libm but the square root, which IEEE 754 fixes: the same bytes on every processor.
Compiled code is kept beside the source, in numba's own user folder where that can't be written, or in NUMBA_CACHE_DIR;
it is compiled anew when the source of any kernel has changed (`STAMP`).
Single precision throughout: a plain literal would make a sum double, hence the constants.

Kernels make no arrays: what they need is handed to them. So numba need not count references (`_nrt`), which took two
thirds of the shading's time.
"""

import hashlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt
from numba.core.caching import FunctionCache
from numba.core.compiler import Compiler, Flags

Function = TypeVar("Function", bound=Callable[..., Any])

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
U8 = npt.NDArray[np.uint8]
U32 = npt.NDArray[np.uint32]

f4, f8, i4, u4 = np.float32, np.float64, np.int32, np.uint32
ZERO, HALF, ONE, TWO = f4(0.0), f4(0.5), f4(1.0), f4(2.0)


def stamp_of(sources: Iterable[Path]) -> bytes:
    """By what is in files of kernels; others don't count."""
    texts = (path.read_bytes() for path in sorted(sources))
    return hashlib.blake2b(b"".join(text for text in texts if b"render.kernel" in text), digest_size=16).digest()


STAMP = stamp_of(Path(__file__).parents[1].rglob("*.py"))
"""What compiled code is kept with. Numba looks at a function's own file alone, but a kernel holds what it calls, from
whichever file; and times of files say less than what is in them."""


class _Flags(Flags):  # type: ignore[misc]  # numba has no types
    """Numba's options, compared by what is set.

    It looks up functions by the options that they are compiled with, a hundred thousand times for these kernels, and
    would list all options there are each time: a fifth of the time to compile them.
    """

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Flags) and bool(self._values == other._values)

    def __hash__(self) -> int:
        return hash(frozenset(self._values))


class _Compiler(Compiler):  # type: ignore[misc]
    """Numba's compiler."""

    def __init__(self, *arguments: Any) -> None:
        typing_context, target_context, library, types, returned, flags, locals_ = arguments
        super().__init__(typing_context, target_context, library, types, returned, self.flags(flags), locals_)

    def flags(self, given: Flags) -> Flags:
        """The options to compile with."""
        return _Flags(given)


class _Apart(_Compiler):
    """Told that no two arrays of a function overlap, as it tells itself for loops in parallel."""

    def flags(self, given: Flags) -> Flags:
        """See _Compiler."""
        made = _Flags(given)
        made.noalias = True
        return made


class _Cache(FunctionCache):  # type: ignore[misc]
    """Numba's, which reads all that it knows to compile with (and SciPy) before it hands out what is compiled.

    That is a fifth of a first picture's CPU time; who has to compile has it read then.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._cache_file._source_stamp = STAMP

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was compiled for a signature; None: nothing."""
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


def _compiled(function: Function, **options: Any) -> Function:
    options = {"pipeline_class": _Compiler, "no_cfunc_wrapper": True} | options
    made = numba.njit(error_model="numpy", _nrt=False, **options)(function)
    if hasattr(made, "_cache"):  # with NUMBA_DISABLE_JIT it is the function itself
        made._cache = _Cache(function)
    return cast(Function, made)


def kernel(function: Function) -> Function:
    """Compile a function when it is first called, by Python."""
    return _compiled(function)


def part(function: Function) -> Function:
    """Compile a function that kernels alone call.

    A way in for Python, which takes each array of each argument apart, would take longer to compile than what it does.
    """
    return _compiled(function, no_cpython_wrapper=True)


def inlined(function: Function) -> Function:
    """Compile a part into each that calls it: a call with many arrays costs more than what it does."""
    return _compiled(function, no_cpython_wrapper=True, forceinline=True)


def streamed(function: Function) -> Function:
    """Compile a part with loops over arrays of which none that is written overlaps another.

    Those can be made of vector instructions, with look-ups and all, which takes a third of the time.
    """
    return _compiled(function, no_cpython_wrapper=True, pipeline_class=_Apart)


def streamed_kernel(function: Function) -> Function:
    """The same of one that Python calls."""
    return _compiled(function, pipeline_class=_Apart)
