"""Numbers that are no float64 array yet: taken where a float64 holds them exactly, else refused with a sentence."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

LARGEST = 1 << 27


def exactly(what: str, given: Any) -> NDArray[np.float64]:
    """``given`` as a float64 array of the same numbers."""
    mask = getattr(given, "mask", None)
    if mask is not None and np.ma.isMaskedArray(given) and np.any(mask):
        raise ValueError(f"{what}: expected numbers, got a masked array; fill it, with NaN where nothing was measured")
    if isinstance(given, (str, bytes, dict, set, frozenset)) or given is None:
        raise TypeError(f"{what}: expected numbers, got {_named(given)}")
    try:
        array = np.asarray(given)
    except Exception as fault:
        raise ValueError(f"{what}: expected numbers in rows of one length, got {_named(given)} ({fault})") from None
    if array.dtype.kind not in "fiub":
        if array.dtype.kind == "O" and array.size == 0:
            return np.zeros(array.shape)
        raise TypeError(f"{what}: expected real numbers, got {_named(given)} of {array.dtype}")
    if array.size > LARGEST:
        raise ValueError(f"{what}: expected at most {LARGEST} numbers, got {array.size}")
    with np.errstate(all="ignore"):
        converted = np.array(array, dtype=np.float64)
        wide = array.dtype.kind in "iu" or array.dtype.itemsize > 8
        if wide and not np.array_equal(converted.astype(array.dtype), array, equal_nan=array.dtype.kind == "f"):
            raise ValueError(f"{what}: expected numbers that a float64 holds exactly, got {array.dtype} beyond that")
    return converted


def _named(given: Any) -> str:
    name = type(given).__name__
    return f"{'an' if name[:1].lower() in 'aeiou' else 'a'} {name}"
