"""Sets as dictionaries, and settings as JSON.

A zonotope and a constrained zonotope are what ZonoOpt writes to JSON: coefficients as triplets, its names, no binary
generators. `r` and `delta` become generators on the way, which is exact.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

from ._native import Box, ConstrainedZonotope, Ellipsoid, Error, Polytope, Set, Zonotope


def attach(cls: type[Set]) -> None:
    """Gives sets `to_dict` and `from_dict`."""
    cls.to_dict = to_dict  # type: ignore[method-assign]
    cls.from_dict = staticmethod(from_dict)  # type: ignore[method-assign]


def to_dict(self: Set) -> dict[str, Any]:
    """The set as a dictionary that `json.dump` takes; zonotopes in the form of ZonoOpt's JSON."""
    if isinstance(self, Box):
        return {"class": "Box", "lower": self.lower.tolist(), "upper": self.upper.tolist()}
    if isinstance(self, Polytope):
        box = {"lower": self.box.lower.tolist(), "upper": self.box.upper.tolist()}
        return {"class": "Polytope", "box": box, "A": self.A.tolist(), "b": self.b.tolist(), "lower": self.lower.tolist()}
    if isinstance(self, Ellipsoid):
        return {"class": "Ellipsoid", "c": self.c.tolist(), "P": self.P.tolist(), "sigma": self.sigma}
    folded = self.fold()
    assert isinstance(folded, (Zonotope, ConstrainedZonotope))
    generators = folded.G
    n, p = generators.shape
    is_constrained = isinstance(folded, ConstrainedZonotope)
    a, b = (folded.A, folded.b) if isinstance(folded, ConstrainedZonotope) else (np.zeros((0, p)), np.zeros(0))
    return {
        "class": "ConZono" if is_constrained else "Zono",
        "n": n,
        "c": folded.c.tolist(),
        "Gc": _triplets(generators),
        "Gb": _triplets(np.zeros((n, 0))),
        "Ac": _triplets(a),
        "Ab": _triplets(np.zeros((len(b), 0))),
        "b": b.tolist(),
        "zero_one_form": False,
    }


def from_dict(given: dict[str, Any]) -> Set:
    """The set that `to_dict` (or ZonoOpt's JSON, without binary generators) describes. Raises `Error`."""
    if not isinstance(given, dict):
        raise TypeError(f"from_dict: expected a dictionary, got {type(given).__name__}")
    kind = given.get("class")
    try:
        if kind == "Box":
            return Box(given["lower"], given["upper"])
        if kind == "Polytope":
            box = Box(given["box"]["lower"], given["box"]["upper"])
            return Polytope(box, _rows(given["A"], box.dim), given["b"], given["lower"])
        if kind == "Ellipsoid":
            return Ellipsoid(given["c"], given["P"], given["sigma"])
        if kind not in ("Point", "Zono", "ConZono", "HybZono"):
            known = "Box, Zono, ConZono, Point, Polytope or Ellipsoid"
            raise Error(f"from_dict: expected the class {known}, got {kind!r}")
        if given["Gb"]["cols"] or given["Ab"]["cols"]:
            raise Error("from_dict: expected a set without binary generators, got a hybrid zonotope")
        c, g, a, b = np.asarray(given["c"], float), _dense(given["Gc"]), _dense(given["Ac"]), np.asarray(given["b"], float)
        if given["zero_one_form"]:
            # xi = (1 + eta)/2 for eta in [-1, 1]: halves are exact, the sums are not.
            raise Error("from_dict: expected generators in [-1, 1], got zero_one_form; convert it before writing")
    except (KeyError, IndexError) as fault:
        raise Error(f"from_dict: expected the key {fault}, got none") from None
    if kind in ("ConZono", "HybZono"):
        return ConstrainedZonotope(c, g, a, b)
    return Zonotope(c, g)


def _rows(given: list[Any], columns: int) -> Any:
    return np.asarray(given, float) if given else np.zeros((0, columns))


def _triplets(m: Any) -> dict[str, Any]:
    columns, rows = np.nonzero(m.T)
    return {
        "rows": m.shape[0],
        "cols": m.shape[1],
        "trip_rows": rows.tolist(),
        "trip_cols": columns.tolist(),
        "trip_vals": m[rows, columns].tolist(),
    }


def _dense(given: dict[str, Any]) -> Any:
    m = np.zeros((int(given["rows"]), int(given["cols"])))
    for i, j, value in zip(given["trip_rows"], given["trip_cols"], given["trip_vals"], strict=True):
        m[i, j] += value
    return m


def dumps(what: str, given: Any) -> str:
    """``given`` as JSON, numpy's numbers and arrays among it. Raises `Error` at NaN, `TypeError` at what is no number or text."""
    return json.dumps(_plain(what, given), allow_nan=False)


def _plain(what: str, given: Any) -> Any:
    if isinstance(given, (np.generic, np.ndarray)):
        given = given.tolist()
    if given is None or isinstance(given, (str, bool, int)):
        return given
    if isinstance(given, float):
        if not math.isfinite(given):
            raise Error(f"{what}: expected a finite number, got {given}")
        return given
    if isinstance(given, dict):
        return {str(key): _plain(f"{what}: {key}", value) for key, value in given.items()}
    if isinstance(given, (list, tuple)):
        return [_plain(what, value) for value in given]
    raise TypeError(f"{what}: expected numbers, texts, lists or dictionaries, got {type(given).__name__}")
