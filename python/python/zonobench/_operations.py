"""The operations on sets as functions, with ZonoOpt's names and order of arguments."""

from __future__ import annotations

from typing import Any

from ._json import from_dict
from ._native import Set

__all__ = ["affine_map", "cartesian_product", "from_dict", "intersection", "minkowski_sum"]


def affine_map(Z: Set, R: Any, s: Any = None) -> Set:
    """Encloses { R z + s : z in Z }; see `Set.affine_map`."""
    return Z.affine_map(R, s)


def minkowski_sum(Z: Set, Y: Set) -> Set:
    """Encloses { z + y }; see `Set.minkowski_sum`."""
    return Z.minkowski_sum(Y)


def intersection(Z: Set, Y: Set, R: Any = None) -> Set:
    """Encloses { z in Z : R z in Y }; see `Set.intersection`."""
    return Z.intersection(Y, R)


def cartesian_product(Z: Set, Y: Set) -> Set:
    """{ (z, y) }, exact; see `Set.cartesian_product`."""
    return Z.cartesian_product(Y)
