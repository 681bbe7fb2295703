"""numpy's functions of one and two arguments on objects that have them as methods."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np

UNARY = {
    "sqrt": "sqrt",
    "square": "sqr",
    "exp": "exp",
    "expm1": "exp_m1",
    "log": "ln",
    "log10": "log10",
    "log1p": "ln_1p",
    "sin": "sin",
    "cos": "cos",
    "tan": "tan",
    "arcsin": "asin",
    "arccos": "acos",
    "arctan": "atan",
    "sinh": "sinh",
    "cosh": "cosh",
    "tanh": "tanh",
    "arcsinh": "asinh",
    "absolute": "__abs__",
    "fabs": "__abs__",
    "negative": "__neg__",
    "positive": "__pos__",
}

BINARY = {"arctan2": "atan2", "hypot": "hypot", "minimum": "min", "maximum": "max", "fmin": "min", "fmax": "max"}

OPERATORS = {
    "add": operator.add,
    "subtract": operator.sub,
    "multiply": operator.mul,
    "divide": operator.truediv,
    "true_divide": operator.truediv,
    "power": operator.pow,
    "float_power": operator.pow,
}

COMPARISONS = {"less", "less_equal", "greater", "greater_equal", "equal", "not_equal", "isfinite", "isnan", "sign"}


def apply(ufunc: Any, method: str, inputs: tuple[Any, ...], kwargs: dict[str, Any] | None) -> Any:
    """What ``__array_ufunc__`` of such an object returns."""
    name = ufunc.__name__
    if method != "__call__" or kwargs:
        raise TypeError(f"np.{name}: expected a plain call of the function, got {method} {sorted(kwargs or {})}")
    if any(isinstance(x, np.ndarray) and x.ndim for x in inputs):
        arrays = np.broadcast_arrays(*(_boxed(x) for x in inputs), subok=False)
        out = np.empty(arrays[0].shape, dtype=object)
        for at in np.ndindex(out.shape):
            out[at] = apply(ufunc, method, tuple(a[at] for a in arrays), None)
        return out
    values = [x.item() if isinstance(x, (np.ndarray, np.generic)) else x for x in inputs]
    if name in OPERATORS:
        return OPERATORS[name](*values)
    if name in UNARY:
        return getattr(values[0], UNARY[name])()
    if name in BINARY:
        first, second = values
        if not hasattr(first, BINARY[name]):
            # min and max do not mind the order; the others have a number in front, which becomes an object of the other's kind.
            first = second.lift(first) if hasattr(second, "lift") else type(second)(first)
        return getattr(first, BINARY[name])(second)
    if name in COMPARISONS and hasattr(values[0], "refuse"):
        values[0].refuse()
    raise TypeError(f"np.{name} is not among the functions that have an enclosure")


def _boxed(x: Any) -> Any:
    if isinstance(x, np.ndarray):
        return x.astype(object)
    out = np.empty((), dtype=object)
    out[()] = x
    return out
