"""Sets: operators and names, three answers, immutability, pickles, dictionaries."""

from __future__ import annotations

import copy
import json
import pickle
from fractions import Fraction

import numpy as np
import pytest

import zonobench as zb

M = np.array([[0.9, 0.2], [-0.3, 0.8]])


def sets() -> dict[str, zb.Set]:
    box = zb.Box([-1.0, 0.0], [1.0, 0.5])
    z = zb.Zonotope([0.5, 0.5], [[0.1, 0.2, -0.1], [0.1, 0.1, 0.0]])
    c = zb.ConstrainedZonotope([0, 0], [[1, 0, 1], [1, 2, -1]], [[-2, 1, -1]], [2])
    return {
        "box": box,
        "zonotope": z,
        "constrained": c,
        "polytope": zb.Polytope(box, [[1.0, 1.0]], [0.75]),
        "ellipsoid": zb.Ellipsoid([1.0, 2.0], [[2.0, 0.5], [0.5, 1.0]], 2.0),
    }


PROVED = ["box", "zonotope", "constrained", "polytope"]


@pytest.mark.parametrize("name", sets())
def test_a_set_comes_back_from_a_pickle_and_a_dictionary(name: str) -> None:
    x = sets()[name]
    assert pickle.loads(pickle.dumps(x)) == x
    assert copy.deepcopy(x) == x
    again = zb.from_dict(json.loads(json.dumps(x.to_dict())))
    assert type(again) is type(x)
    assert again == x


@pytest.mark.parametrize("name", PROVED)
def test_a_pickle_keeps_rounding_and_slack(name: str) -> None:
    mapped = (M @ sets()[name]).intersect_strip([1.0, 0.3], 0.1, 0.5)
    assert mapped.r.any() and mapped.delta.any()
    assert pickle.loads(pickle.dumps(mapped)) == mapped


def test_a_dictionary_holds_the_rounding_as_generators() -> None:
    z = M @ sets()["zonotope"]
    assert isinstance(z, zb.Zonotope) and z.r.any()
    again = zb.from_dict(z.to_dict())
    assert isinstance(again, zb.Zonotope)
    assert not again.r.any()
    assert again == z.fold()


def test_a_dictionary_is_zonoopts_json() -> None:
    written = sets()["constrained"].to_dict()
    assert set(written) == {"class", "n", "c", "Gc", "Gb", "Ac", "Ab", "b", "zero_one_form"}
    zonoopt = pytest.importorskip("zonoopt")
    import tempfile

    with tempfile.NamedTemporaryFile("w+", suffix=".json") as file:
        json.dump(written, file)
        file.flush()
        theirs = zonoopt.from_json(file.name)
        assert theirs.is_conzono() and theirs.get_nG() == 3
        zonoopt.to_json(theirs, file.name)
        file.seek(0)
        assert zb.from_dict(json.load(file)) == sets()["constrained"]


@pytest.mark.parametrize("name", PROVED)
def test_operators_are_the_methods(name: str) -> None:
    x = sets()[name]
    y = zb.Zonotope([0.1, 0.0], [[0.2], [0.3]])
    t = np.array([1.0, -1.0])
    assert M @ x == x.affine_map(M) == zb.affine_map(x, M)
    assert x + y == x.minkowski_sum(y) == zb.minkowski_sum(x, y)
    assert (x + t) == (t + x)
    assert x & y == x.intersection(y) == zb.intersection(x, y)
    assert 2 * x == x * 2.0 == np.float64(2) * x
    assert -(-x) == x
    assert x.cartesian_product(y).dim == 4
    assert M.tolist() @ x == M @ x


@pytest.mark.parametrize("name", PROVED)
def test_points_of_a_set_are_in_its_images(name: str) -> None:
    """Maps, sums, intersections and hulls keep every point: corners of a polygon inside, by exact rationals of the vertices."""
    x = sets()[name]
    y = zb.Zonotope([0.1, 0.0], [[0.2], [0.3]])
    inside = [p for p in 0.999 * x.vertices() + 0.001 * x.vertices().mean(axis=0) if x.contains(p)]
    assert len(inside) >= 3
    hull = x.bounding_box()
    for p in inside:
        assert p in hull
        assert (M @ x).contains(M @ p) is not False
        assert (x + y).contains(p + [0.1, 0.0]) is not False
        assert x.support([1.0, 2.0]) >= p @ [1.0, 2.0]
        assert p in x.project(0, 1)
        assert x.reduce(9).contains(p) is not False


def test_a_hull_contains_the_exact_one() -> None:
    z = zb.Zonotope([0.1, 0.2], [[0.1, 0.3, 1e-17], [0.7, -0.2, 0.4]])
    hull = z.bounding_box()
    for i in range(2):
        exact = sum(abs(Fraction(g)) for g in z.G[i])
        assert Fraction(hull.lower[i]) <= Fraction(z.c[i]) - exact
        assert Fraction(z.c[i]) + exact <= Fraction(hull.upper[i])
        assert hull.widths[i] < 2 * float(exact) * (1 + 1e-14)


def test_membership_has_three_answers() -> None:
    box = zb.Box([0.0], [1.0])
    assert box.contains([0.5]) is True
    assert box.contains([1.5]) is False
    assert box.contains(zb.Box([0.5], [1.5])) is None
    assert [0.5] in box
    assert zb.Box([0.5], [1.5]) not in box


def test_emptiness_has_three_answers_and_an_empty_hull_raises() -> None:
    c = zb.ConstrainedZonotope([0, 0], np.eye(2), [[1.0, 1.0]], [0.5])
    assert c.is_empty() is False
    empty = zb.ConstrainedZonotope([0, 0], np.eye(2), [[1.0, 1.0]], [2.5])
    assert empty.is_empty() is True
    with pytest.raises(zb.Empty, match="empty"):
        empty.bounding_box()
    with pytest.raises(zb.Empty):
        zb.Box([0], [1]) & zb.Box([2], [3])


def test_a_polytope_is_the_set_of_its_half_spaces() -> None:
    p = sets()["polytope"]
    assert isinstance(p, zb.Polytope)
    assert p.contains([0.0, 0.2]) and p.contains([0.9, 0.4]) is False
    assert p.volume() == pytest.approx(1.0 - 0.5 * 0.75**2 + 0.5 * 0.25**2, abs=1e-12)
    q = sets()["zonotope"].to_polytope()
    assert q.volume() == pytest.approx(sets()["zonotope"].volume(), rel=1e-9)
    assert np.all(q.A @ sets()["zonotope"].vertices().T <= q.b[:, None] + 1e-12)


def test_sets_are_immutable_and_their_arrays_are_copies() -> None:
    z = sets()["zonotope"]
    assert isinstance(z, zb.Zonotope)
    z.G[0, 0] = 100.0
    z.c[:] = 100.0
    assert z == sets()["zonotope"]
    with pytest.raises(AttributeError):
        z.c = np.zeros(2)  # type: ignore[misc]
    g = np.eye(2)
    of_g = zb.Zonotope([0, 0], g)
    g[0, 0] = 5.0
    assert of_g.G[0, 0] == 1.0


def test_arrays_of_any_layout_and_exact_type_are_taken() -> None:
    g = np.arange(12.0).reshape(3, 4)
    expected = zb.Zonotope([0, 0, 0], g)
    layouts = [np.asfortranarray(g), g[:, ::-1][:, ::-1], np.repeat(g, 2, axis=1)[:, ::2], g.astype(np.float32)]
    layouts += [g.astype(np.int64), g.astype(np.longdouble), g.astype(">f8"), g.tolist(), np.matrix(g)]
    readonly = g.copy()
    readonly.flags.writeable = False
    for given in [*layouts, readonly]:
        assert zb.Zonotope([0, 0, 0], given) == expected, type(given)


def test_numbers_that_a_double_does_not_hold_are_refused() -> None:
    with pytest.raises(ValueError, match="exactly"):
        zb.Box([2**53 + 1], [2**54])
    if np.finfo(np.longdouble).nmant > 52:
        with pytest.raises(ValueError, match="exactly"):
            zb.Box(np.array([np.longdouble(1) / 3]), [1.0])


def test_intervals_contain_exact_results() -> None:
    a, b = zb.Interval(0.1, 0.3), zb.Interval(-0.2, 0.7)
    for operation in ("__add__", "__sub__", "__mul__"):
        result = getattr(a, operation)(b)
        for x in (a.lo, a.hi):
            for y in (b.lo, b.hi):
                exact = getattr(Fraction(x), operation)(Fraction(y))
                assert Fraction(result.lo) <= exact <= Fraction(result.hi)
    assert 0.2 in a and 0.4 not in a
    assert (a & b) == a and (a | b) == b
    assert a**2 == a.sqr() and (2**a).lo <= 2**0.1 <= (2**a).hi
    with pytest.raises(zb.Error, match="domain"):
        1 / b
    with pytest.raises(zb.Error, match="domain"):
        b.sqrt()


def test_numpys_functions_work_on_intervals() -> None:
    a = zb.Interval(0.1, 0.3)
    assert np.sin(a) == a.sin() and np.hypot(a, 1.0) == a.hypot(1.0)
    assert np.maximum(0.2, a) == zb.Interval(0.2, 0.3)
    both = np.array([[0.5, 0.25]]) @ np.array([a, a], dtype=object)
    assert both[0].lo <= 0.075 and both[0].hi >= 0.225
    with pytest.raises(TypeError, match="enclosure"):
        np.floor(a)


def test_the_support_is_a_number_or_one_for_each_row() -> None:
    c = sets()["constrained"]
    one = c.support([1.0, 0.0])
    assert isinstance(one, float)
    many = c.support(np.array([[1.0, 0.0], [0.0, 1.0]]))
    assert many.shape == (2,) and many[0] == one
    assert c.bounding_box().upper[0] == pytest.approx(one, rel=1e-12)


def test_an_ellipsoid_mixes_with_no_other_set() -> None:
    e = sets()["ellipsoid"]
    assert e.contains([1.0, 2.0]) is True
    assert e.support([1.0, 0.0]) == pytest.approx(1.0 + 2.0)
    with pytest.raises(zb.Unsupported, match="probabilities"):
        e & sets()["box"]
    assert (M @ e).bounding_box().dim == 2


def test_sides_of_a_box_are_intervals() -> None:
    box = zb.Box([0, 1, 2], [1, 2, 3])
    assert [side.lo for side in box] == [0.0, 1.0, 2.0]  # type: ignore[attr-defined]
    assert box[-1] == zb.Interval(2, 3) and len(box) == 3
    with pytest.raises(IndexError):
        box[3]


def test_the_docstring_of_the_package_is_true() -> None:
    import doctest

    assert doctest.testmod(zb).failed == 0
