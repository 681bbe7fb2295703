"""Set-membership and mixed state estimation with proved enclosures.

>>> import numpy as np, zonobench as zb
>>> Z = zb.Zonotope([0.0, 0.0], [[1.0, 0.5], [0.0, 1.0]])
>>> (np.array([[0.9, 0.2], [-0.2, 0.9]]) @ Z).bounding_box().widths.round(2)
array([3.1, 2. ])

Sets: `Interval`, `Box`, `Zonotope`, `ConstrainedZonotope`, `Polytope`, `Ellipsoid`. A system is a `System`; with what is known of
its first state and its noises it is a `Problem`; an estimator (`Czmv`, `Kalman`, ...) takes a problem. `Online` makes a step at
a time, `track` a whole recording, `simulate` makes one. `lake` reads what the program wrote.

Answers come in three kinds: True and False are proved, None was not decided.
"""

from __future__ import annotations

from . import _json, _plot
from ._estimators import (
    BoxStateEst,
    Comb,
    CombPlus,
    Czfo,
    Czmv,
    DCz,
    DRrsr,
    DZb,
    Ekf,
    Ezgkf,
    EzgkfM,
    Ezgkp,
    Inzsmf,
    Kalman,
    Lift,
    Particle,
    Rrsr,
    Ukf,
    Zfo,
    Zmv,
    Zsmf,
)
from ._lake import Lake, lake
from ._native import (
    Belief,
    Box,
    ConstrainedZonotope,
    Diverged,
    Ellipsoid,
    Empty,
    Error,
    Estimator,
    Inconsistent,
    Interval,
    Online,
    Overflow,
    Polytope,
    Problem,
    Refused,
    Set,
    Singular,
    System,
    Uncertain,
    Unsupported,
    Zonotope,
    __version__,
)
from ._operations import affine_map, cartesian_product, from_dict, intersection, minkowski_sum
from ._systems import attach as _attach
from ._track import Phase, Track, Trajectory, simulate, track

_attach(System)
_json.attach(Set)
_plot.attach(Set)

__all__ = [
    "Belief",
    "Box",
    "BoxStateEst",
    "Comb",
    "CombPlus",
    "ConstrainedZonotope",
    "Czfo",
    "Czmv",
    "DCz",
    "DRrsr",
    "DZb",
    "Diverged",
    "Ekf",
    "Ellipsoid",
    "Empty",
    "Error",
    "Estimator",
    "Ezgkf",
    "EzgkfM",
    "Ezgkp",
    "Inconsistent",
    "Interval",
    "Inzsmf",
    "Kalman",
    "Lake",
    "Lift",
    "Online",
    "Overflow",
    "Particle",
    "Phase",
    "Polytope",
    "Problem",
    "Refused",
    "Rrsr",
    "Set",
    "Singular",
    "System",
    "Track",
    "Trajectory",
    "Ukf",
    "Uncertain",
    "Unsupported",
    "Zfo",
    "Zmv",
    "Zonotope",
    "Zsmf",
    "__version__",
    "affine_map",
    "cartesian_product",
    "from_dict",
    "intersection",
    "lake",
    "minkowski_sum",
    "simulate",
    "track",
]
