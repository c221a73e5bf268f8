"""How the renderer's inner loops are compiled: by numba, to the same figures on every machine.

No `fastmath`, and no functions of libm but the square root, which IEEE 754 fixes: the same bytes on every processor.
Compiled code is kept beside the source, in numba's own user folder where that can't be written, or in NUMBA_CACHE_DIR.
Single precision throughout: a plain literal would make a sum double, hence the constants.

Kernels make no arrays: what they need is handed to them. So numba need not count references (`_nrt`), which took two
thirds of the shading's time.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt
from numba.core.compiler import Compiler

Function = TypeVar("Function", bound=Callable[..., Any])

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
U8 = npt.NDArray[np.uint8]
U32 = npt.NDArray[np.uint32]

f4, f8, i4, u4 = np.float32, np.float64, np.int32, np.uint32
ZERO, HALF, ONE, TWO = f4(0.0), f4(0.5), f4(1.0), f4(2.0)


def kernel(function: Function) -> Function:
    """Compile a function when it is first called."""
    return cast(Function, numba.njit(cache=True, error_model="numpy", _nrt=False)(function))


def inlined(function: Function) -> Function:
    """Compile a function into each that calls it: a call with many arrays costs more than what it does."""
    return cast(Function, numba.njit(cache=True, error_model="numpy", _nrt=False, forceinline=True)(function))


class _Apart(Compiler):  # type: ignore[misc]  # numba has no types
    """Numba's compiler, told that no two arrays of a function overlap, as it tells itself for loops in parallel."""

    def __init__(self, *arguments: Any) -> None:
        typing_context, target_context, library, types, returned, flags, locals_ = arguments
        flags.noalias = True
        super().__init__(typing_context, target_context, library, types, returned, flags, locals_)


def streamed(function: Function) -> Function:
    """Compile loops over arrays of which none that is written overlaps another.

    Those can be made of vector instructions, with look-ups and all, which takes a third of the time.
    """
    made = numba.njit(cache=True, error_model="numpy", _nrt=False, pipeline_class=_Apart)
    return cast(Function, made(function))
