#!/usr/bin/env python3
"""What a call through Python costs above Rust, and the package beside ZonoOpt where it is installed: ratios of one run.

Times of both sides alternate and the least of each is taken; on a machine that does other things too, the ratios hold better
than the times. pycvxset is on no package index and is left out.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import zonobench as zb
from zonobench import _native


def least(rounds: int, *sides: Callable[[], float]) -> list[float]:
    """The least of each side's times, in turn."""
    best = [float("inf")] * len(sides)
    for _ in range(rounds):
        for i, side in enumerate(sides):
            best[i] = min(best[i], side())
    return best


def timed(call: Callable[[], Any], n: int) -> Callable[[], float]:
    def run() -> float:
        start = time.perf_counter()
        for _ in range(n):
            call()
        return (time.perf_counter() - start) / n

    return run


def overheads(rounds: int) -> None:
    cart = zb.Problem(
        zb.System.linear([[1.0, 0.1], [0.0, 0.95]], B=[[0.0], [0.1]], C=[[1.0, 0.0]]),
        zb.Uncertain(zb.Box([-1, -1], [1, 1]), covariance=0.1 * np.eye(2)),
        w=zb.Uncertain(zb.Box([-0.01, -0.02], [0.01, 0.02]), covariance=np.diag([1e-5, 4e-5])),
        v=zb.Uncertain(zb.Box([-0.5], [0.5]), covariance=[[3e-4]]),
    )
    cases: list[tuple[str, Any, int, float]] = [
        ("Kalman, n = 2", zb.Kalman(cart), 20_000, 3.0),
        ("CZMV, n = 2, 20 generators, 5 constraints", zb.Czmv(cart, generators=20, constraints=5), 2_000, 10.0),
    ]
    print("step of Online: Python's time, Rust's, the difference, the ratio")
    u, y = np.array([0.0]), np.array([0.0])
    for name, estimator, n, bound in cases:

        def python(estimator: Any = estimator, n: int = n) -> float:
            online = zb.Online(estimator)
            return timed(lambda: online.step(u, y), n)()

        def rust(estimator: Any = estimator, n: int = n) -> float:
            return _native._seconds_from_rust(estimator, u, y, n) / n

        ours, theirs = least(rounds, python, rust)
        above = (ours - theirs) * 1e6
        word = "within" if above <= bound else "ABOVE"
        print(f"  {name}: {ours * 1e6:.2f} us, {theirs * 1e6:.2f} us, {above:+.2f} us ({word} {bound:g}), {ours / theirs:.2f}")


def peers(rounds: int) -> None:
    try:
        import scipy.sparse
        import zonoopt
    except ImportError:
        print("ZonoOpt is not installed: pip install zonoopt")
        return
    rng = np.random.default_rng(1)
    print("ZonoOpt's time over ours, both from Python; what its hull is inside ours by, over the width")
    for n, q, p in [(2, 5, 20), (12, 12, 40)]:
        c, g, a = rng.normal(size=n), rng.normal(size=(n, p)), rng.normal(size=(q, p))
        b = a @ rng.uniform(-0.5, 0.5, p)
        ours, theirs = zb.ConstrainedZonotope(c, g, a, b), zonoopt.ConZono(g, c, a, b)
        ratios = []
        for _ in range(rounds):
            mine, other = least(1, timed(ours.bounding_box, 20), timed(theirs.bounding_box, 5))
            ratios.append(other / mine)
        hull, other_hull = ours.bounding_box(), theirs.bounding_box()
        lower, upper = np.asarray(other_hull.lower()), np.asarray(other_hull.upper())
        inside = np.maximum(lower - hull.lower, hull.upper - upper) / hull.widths
        print(f"  hull ({n}, {q}, {p}): {spread(ratios)}; {inside.max():.1e}")
        r, y = rng.normal(size=(2, n)), zb.Zonotope(np.zeros(2), np.eye(2))
        theirs_y = zonoopt.Zono(np.eye(2), np.zeros(2))
        sparse = scipy.sparse.csc_matrix(r)
        ratios = []
        for _ in range(rounds):
            mine, other = least(
                1,
                timed(lambda: ours.intersection(y, r), 200),
                timed(lambda: zonoopt.intersection(theirs, theirs_y, sparse), 200),
            )
            ratios.append(other / mine)
        print(f"  generalized intersection ({n}, {q}, {p}): {spread(ratios)}")


def spread(ratios: list[float]) -> str:
    return f"{np.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=9, help="how often each side is timed")
    given = parser.parse_args()
    overheads(given.rounds)
    peers(given.rounds)
