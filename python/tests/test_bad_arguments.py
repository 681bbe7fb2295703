"""Whatever comes in: an exception with a sentence; never a panic, which is no `Exception`, and never an abort."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import zonobench as zb

NAN, INF = float("nan"), float("inf")


def huge() -> Any:
    """An array of 2^40 zeros that takes eight bytes."""
    return np.broadcast_to(0.0, (2, 2**39))


class Liar:
    """What is an array until somebody looks."""

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise RuntimeError("no array after all")


#: Of a measurement, what was not made: no mistake.
GAPS = {"NaN", "None", "None inside"}


def not_vectors() -> dict[str, Any]:
    return {
        "None": None,
        "text": "0, 1",
        "number": 1.5,
        "complex": np.array([1j, 2.0]),
        "objects": np.array([object(), 1.0], dtype=object),
        "NaN": [0.0, NAN],
        "infinite": np.array([INF, 0.0]),
        "matrix": np.zeros((2, 2)),
        "ragged": [[1.0], [1.0, 2.0]],
        "texts": ["a", "b"],
        "dates": np.array(["2020-01-01", "2020-01-02"], dtype="datetime64[D]"),
        "dictionary": {0: 1.0},
        "set": {1.0, 2.0},
        "long": np.zeros(7),
        "empty": [],
        "too large an integer": [2**64, 0],
        "not exact": [2**53 + 1, 0],
        "masked": np.ma.array([1.0, 2.0], mask=[True, False]),
        "structured": np.zeros(2, dtype=[("a", float)]),
        "liar": Liar(),
        "huge": np.broadcast_to(0.0, (2**40,)),
        "function": len,
        "None inside": [None, 1.0],
    }


def not_matrices() -> dict[str, Any]:
    return {
        "None": None,
        "vector": [0.0, 1.0],
        "text": "[[1]]",
        "complex": np.eye(2) * 1j,
        "NaN": [[NAN, 0.0], [0.0, 1.0]],
        "infinite": [[1.0, 0.0], [0.0, -INF]],
        "cube": np.zeros((2, 2, 2)),
        "tall": np.zeros((5, 3)),
        "huge": huge(),
        "objects": np.array([[object()] * 2] * 2),
        "ragged": [[1.0], [1.0, 2.0]],
        "liar": Liar(),
    }


Z = zb.Zonotope([0, 0], np.eye(2))
C = zb.ConstrainedZonotope([0, 0], np.eye(2), [[1, 1]], [0])
BOX = zb.Box([0, 0], [1, 1])
S = zb.System.raimondo()
LINEAR = zb.System.linear([[1.0, 0.1], [0.0, 0.95]], B=[[0.0], [0.1]], C=[[1.0, 0.0]])
P = zb.Problem(S, BOX, w=BOX, v=BOX)
Q = zb.Problem(LINEAR, zb.Uncertain(BOX, covariance=np.eye(2)), w=BOX, v=zb.Box([-1], [1]))
EST = zb.Zmv(P, generators=8)
EST_U = zb.BoxStateEst(Q)


def attempts() -> Iterator[tuple[str, Callable[[], Any]]]:
    for name, bad in not_vectors().items():
        yield f"Box lower {name}", lambda bad=bad: zb.Box(bad, [1.0, 1.0])
        yield f"Zonotope c {name}", lambda bad=bad: zb.Zonotope(bad, np.eye(2))
        yield f"ConstrainedZonotope b {name}", lambda bad=bad: zb.ConstrainedZonotope([0, 0], np.eye(2), np.eye(2), bad)
        yield f"contains {name}", lambda bad=bad: Z.contains(bad)
        if name != "matrix":
            yield f"support {name}", lambda bad=bad: C.support(bad)
        yield f"translation {name}", lambda bad=bad: Z + bad
        yield f"System.f {name}", lambda bad=bad: S.f(bad)
        if name not in GAPS:
            yield f"step y {name}", lambda bad=bad: zb.Online(EST).step(None, bad)
        if name != "None":
            yield f"simulate x0 {name}", lambda bad=bad: zb.simulate(P, 3, x0=bad)
            yield f"Uncertain mean {name}", lambda bad=bad: zb.Uncertain(BOX, mean=bad)
    for name, bad in not_matrices().items():
        yield f"Zonotope G {name}", lambda bad=bad: zb.Zonotope([0, 0], bad)
        yield f"ConstrainedZonotope A {name}", lambda bad=bad: zb.ConstrainedZonotope([0, 0], np.eye(2), bad, [0, 0])
        yield f"map {name}", lambda bad=bad: Z.affine_map(bad)
        yield f"Ellipsoid P {name}", lambda bad=bad: zb.Ellipsoid([0, 0], bad)
        yield f"linear A {name}", lambda bad=bad: zb.System.linear(bad, C=np.eye(2))
        yield f"linear C {name}", lambda bad=bad: zb.System.linear(np.eye(2), C=bad)
        if name not in GAPS:
            yield f"track y {name}", lambda bad=bad: zb.track(EST, bad)
        if name != "None":
            yield f"Polytope A {name}", lambda bad=bad: zb.Polytope(BOX, bad, [1.0, 1.0])
            yield f"covariance {name}", lambda bad=bad: zb.Uncertain(BOX, covariance=bad)
    singles: list[tuple[str, Callable[[], Any]]] = [
        ("reversed", lambda: zb.Box([1, 0], [0, 1])),
        ("no sides", lambda: zb.Box([], [])),
        ("negative radius", lambda: zb.Box.from_center_radius([0], [-1])),
        ("negative r", lambda: zb.Zonotope([0], [[1]], r=[-1])),
        ("negative delta", lambda: zb.ConstrainedZonotope([0], [[1]], [[1]], [0], delta=[-1])),
        ("reversed interval", lambda: zb.Interval(1, 0)),
        ("interval of a list", lambda: zb.Interval([1, 2])),
        ("interval of NaN", lambda: zb.Interval(NAN)),
        ("interval of text", lambda: zb.Interval("0.1")),
        ("interval + text", lambda: zb.Interval(1) + "1"),
        ("interval / 0", lambda: zb.Interval(1) / 0),
        ("overflow", lambda: zb.Interval(1e308) * 10),
        ("power", lambda: zb.Interval(2) ** 10**6),
        ("wrong columns", lambda: np.eye(3) @ Z),
        ("wrong t", lambda: Z.affine_map(np.eye(2), [1])),
        ("set @ matrix", lambda: Z @ np.eye(2)),
        ("set - set", lambda: Z - Z),
        ("set * set", lambda: Z * Z),
        ("set * NaN", lambda: Z * NAN),
        ("set * array", lambda: Z * np.ones(2)),
        ("set & array", lambda: Z & np.ones(2)),
        ("set + text", lambda: Z + "x"),
        ("dimensions", lambda: Z + zb.Box([0], [1])),
        ("dimensions &", lambda: Z & zb.Box([0], [1])),
        ("wrong R", lambda: Z.intersection(zb.Box([0], [1]), np.eye(2))),
        ("strip", lambda: Z.intersect_strip([1, 0], 0, -1)),
        ("strip text", lambda: Z.intersect_strip([1, 0], "0", 1)),
        ("half-space", lambda: Z.intersect_halfspace([1, 0], -5)),
        ("half-space NaN", lambda: Z.intersect_halfspace([1, 0], NAN)),
        ("project nothing", lambda: Z.project()),
        ("project far", lambda: Z.project(2)),
        ("project text", lambda: Z.project("x")),
        ("project half", lambda: Z.project(0.5)),
        ("reduce", lambda: Z.cartesian_product(Z).reduce(1)),
        ("reduce minus", lambda: Z.reduce(-1)),
        ("reduce half", lambda: Z.reduce(1.5)),
        ("reduce how", lambda: Z.reduce(4, method="best")),
        ("reduce far", lambda: C.reduce(0)),
        ("vertices in 4", lambda: Z.cartesian_product(Z).vertices()),
        ("polytope in 4", lambda: Z.cartesian_product(Z).to_polytope()),
        ("vertices of an ellipsoid", lambda: zb.Ellipsoid([0, 0], np.eye(2)).vertices()),
        ("to_zonotope", lambda: C.to_zonotope()),
        ("huge map", lambda: np.zeros((2**20, 2)) @ zb.Zonotope([0, 0], np.zeros((2, 2**12)))),
        ("huge outline", lambda: zb.Ellipsoid([0, 0], np.eye(2)).outline(10**12)),
        ("ellipsoid indefinite", lambda: zb.Ellipsoid([0, 0], [[1, 2], [2, 1]])),
        ("ellipsoid skew", lambda: zb.Ellipsoid([0, 0], [[1, 2], [0, 9]])),
        ("sigma", lambda: zb.Ellipsoid([0], [[1]], -1)),
        ("alpha", lambda: zb.Ellipsoid.with_confidence([0], [[1]], 1.5)),
        ("ellipsoid contains box", lambda: zb.Ellipsoid([0, 0], np.eye(2)).contains(BOX)),
        ("polytope of no box", lambda: zb.Polytope(Z)),
        ("polytope zero row", lambda: zb.Polytope(BOX, [[0, 0]], [1])),
        ("polytope empty", lambda: zb.Polytope(BOX, [[1, 0]], [-5])),
        ("polytope reversed", lambda: zb.Polytope(BOX, [[1, 0]], [0], lower=[1])),
        ("polytope b alone", lambda: zb.Polytope(BOX, b=[1])),
        ("from_dict nothing", lambda: zb.from_dict({})),
        ("from_dict text", lambda: zb.from_dict("Zono")),
        ("from_dict class", lambda: zb.from_dict({"class": "Zono"})),
        ("from_dict hybrid", lambda: zb.from_dict({**Z.to_dict(), "Gb": {"cols": 1}})),
        ("from_json", lambda: zb.System.from_json("{")),
        ("from_json kind", lambda: zb.System.from_json('{"kind": "car"}')),
        ("period", lambda: zb.System.van_der_pol(-1.0)),
        ("period NaN", lambda: zb.System.van_der_pol(NAN)),
        ("form", lambda: zb.System.raimondo(form="loose")),
        ("period text", lambda: zb.System.vehicle_se2("0.1")),
        ("mass", lambda: zb.System.quadrotor(m=0, l=1, ixx=1, iyy=1, izz=1, g=9.81, dt=0.01)),
        ("landmarks", lambda: zb.System.unicycle(t0=1, phi_omega=1, phi_theta=1, landmarks=[[1, 2, 3]])),
        ("lpv", lambda: zb.System.lpv(np.eye(2), [np.eye(3)], C=np.eye(2))),
        ("linear without C", lambda: zb.System.linear(np.eye(2))),
        ("f without u", lambda: LINEAR.f([0, 0])),
        ("f of a zonotope", lambda: S.f(Z)),
        ("f undefined", lambda: S.f(zb.Box([-5, 0], [5, 1]))),
        ("jacobian undefined", lambda: S.jacobian(zb.Box([-5, 0], [5, 1]))),
        ("k", lambda: S.f([0, 0], k=-1)),
        ("problem of text", lambda: zb.Problem("raimondo", BOX)),
        ("problem without w", lambda: zb.Problem(S, BOX)),
        ("problem of wrong size", lambda: zb.Problem(S, zb.Box([0], [1]), w=BOX, v=BOX)),
        ("problem with an ellipsoid", lambda: zb.Problem(S, zb.Ellipsoid([0, 0], np.eye(2)), w=BOX, v=BOX)),
        ("nothing uncertain", lambda: zb.Uncertain()),
        ("indefinite", lambda: zb.Uncertain(BOX, covariance=[[1, 2], [2, 1]])),
        ("estimator without problem", lambda: zb.Zmv(S, generators=8)),
        ("missing setting", lambda: zb.Zmv(P)),
        ("unknown setting", lambda: zb.Zmv(P, generators=8, order=2)),
        ("few generators", lambda: zb.Zmv(P, generators=1)),
        ("negative generators", lambda: zb.Zmv(P, generators=-3)),
        ("half a generator", lambda: zb.Zmv(P, generators=8.5)),
        ("generators NaN", lambda: zb.Zmv(P, generators=NAN)),
        ("generators text", lambda: zb.Zmv(P, generators="8")),
        ("generators object", lambda: zb.Zmv(P, generators=object())),
        ("wrong h", lambda: zb.Czmv(P, generators=8, constraints=2, h="c9")),
        ("kalman of a nonlinear system", lambda: zb.Kalman(P)),
        ("vehicle filter of another system", lambda: zb.Inzsmf(P, generators=20)),
        ("eta", lambda: zb.Ezgkf(Q, phi=8, eta=2.0, alpha=0.01)),
        ("estimator twice", lambda: zb.Online(zb.Online(EST))),
        ("online of nothing", lambda: zb.Online(None)),
        ("step without u", lambda: zb.Online(EST_U).step(None, [0.0])),
        ("step with NaN u", lambda: zb.Online(EST_U).step([NAN], [0.0])),
        ("step with infinite y", lambda: zb.Online(EST).step(None, [INF, 0.0])),
        ("step with u", lambda: zb.Online(EST).step([1.0], [0.0, 0.0])),
        ("foreign belief", lambda: EST.update(0, EST_U.prior(), None, [0, 0])),
        ("predict of nothing", lambda: EST.predict(1, None)),
        ("predict to k = 0", lambda: EST.predict(0, EST.prior())),
        ("belief contains", lambda: EST.prior().contains([0.0])),
        ("belief outline", lambda: EST.prior().outline(0, 9)),
        ("ellipsoid of a set", lambda: EST.prior().ellipsoid(0.01)),
        ("track of a problem", lambda: zb.track(P, np.zeros((3, 2)))),
        ("track of no rows", lambda: zb.track(EST, np.zeros((0, 2)))),
        ("track without u", lambda: zb.track(EST_U, np.zeros((3, 1)))),
        ("track with short u", lambda: zb.track(EST_U, np.zeros((3, 1)), np.zeros((1, 1)))),
        ("track with infinite y", lambda: zb.track(EST, [[INF, 0.0]])),
        ("simulate nothing", lambda: zb.simulate(None, 3)),
        ("simulate backwards", lambda: zb.simulate(P, -1)),
        ("simulate for ever", lambda: zb.simulate(P, 10**15)),
        ("simulate half a step", lambda: zb.simulate(P, 1.5)),
        ("seed", lambda: zb.simulate(P, 3, seed=-1)),
        ("law", lambda: zb.simulate(P, 3, w="normal")),
        ("noise of wrong size", lambda: zb.simulate(P, 3, w=np.zeros((3, 5)))),
        ("too few rows of noise", lambda: zb.simulate(P, 3, w=np.zeros((1, 2)))),
        ("simulate without u", lambda: zb.simulate(Q, 3, x0=[0, 0])),
        ("lake", lambda: zb.lake("/nowhere/at/all")),
        ("no motion", lambda: zb.System.equations(x=["a"], output={"y": "a"})),
        ("both motions", lambda: zb.System.equations(x=["a"], next=["a"], rate=["a"], output={"y": "a"})),
        ("unknown name", lambda: zb.System.equations(x=["a"], next=["b"], output={"y": "a"})),
        ("not a name", lambda: zb.System.equations(x=["1a"], next=["1"], output={"y": "1"})),
        ("deep", lambda: zb.System.equations(x=["a"], next=["(" * 10**5 + "a"], output={"y": "a"})),
        ("long", lambda: zb.System.equations(x=["a"], next=["a + " * 10**6 + "a"], output={"y": "a"})),
        ("no period", lambda: zb.System.equations(x=["a"], rate=["a"], output={"y": "a"})),
        ("substeps", lambda: zb.System.equations(x=["a"], rate=["a"], output={"y": "a"}, period=1, substeps=0)),
        ("many substeps", lambda: zb.System.equations(x=["a"], rate=["a"], output={"y": "a"}, period=1, substeps=10**9)),
        ("method", lambda: zb.System.equations(x=["a"], rate=["a"], output={"y": "a"}, period=1, method="magic")),
        ("names as text", lambda: zb.System.equations(x="a b", next=["a"], output={"y": "a"})),
        ("parameter NaN", lambda: zb.System.equations(x=["a"], next=["a"], output={"y": "a"}, parameters={"p": NAN})),
        ("parameter text", lambda: zb.System.equations(x=["a"], next=["a"], output={"y": "a"}, parameters={"p": "1"})),
        ("branch", lambda: zb.System.trace(lambda x: x if x[0] > 0 else -x, lambda x: x, x=["a"])),
        ("math", lambda: zb.System.trace(lambda x: float(x[0]), lambda x: x, x=["a"])),
        ("no function", lambda: zb.System.trace("x", lambda x: x, x=["a"])),
        ("argument", lambda: zb.System.trace(lambda q: q, lambda x: x, x=["a"])),
        ("components", lambda: zb.System.trace(lambda x: [x[0], x[0]], lambda x: x, x=["a"])),
        ("traced text", lambda: zb.System.trace(lambda x: [x[0] + "1"], lambda x: x, x=["a"])),
        ("traced NaN", lambda: zb.System.trace(lambda x: [x[0] + NAN], lambda x: x, x=["a"])),
        ("traced complex", lambda: zb.System.trace(lambda x: [x[0] * 1j], lambda x: x, x=["a"])),
        ("traced floor", lambda: zb.System.trace(lambda x: [np.floor(x[0])], lambda x: x, x=["a"])),
    ]
    yield from singles


ATTEMPTS = list(attempts())


def test_there_are_more_than_two_hundred() -> None:
    assert len(ATTEMPTS) > 200


@pytest.mark.parametrize("attempt", [a for _, a in ATTEMPTS], ids=[name for name, _ in ATTEMPTS])
def test_a_bad_argument_is_an_exception_with_a_sentence(attempt: Callable[[], Any]) -> None:
    # A panic is a BaseException and no Exception: it would pass through here and fail the test.
    with pytest.raises((ValueError, TypeError, IndexError, OverflowError)) as caught:
        attempt()
    sentence = str(caught.value)
    assert len(sentence.split()) >= 3, repr(sentence)
    assert "panic" not in sentence and "unwrap" not in sentence
