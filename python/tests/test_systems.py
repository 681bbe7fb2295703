"""Systems: equations as text, SymPy's expressions, traced functions, named systems, values and derivatives."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest

import zonobench as zb

PENDULUM = {
    "x": {"phi": "rad", "omega": "rad/s"},
    "w": ["push"],
    "v": ["e"],
    "y": {"range": "m"},
    "period": 0.02,
}


def written() -> zb.System:
    return zb.System.equations(
        **PENDULUM,
        next={"phi": "phi + 0.02*omega", "omega": "omega + 0.02*(-9.81*sin(phi) - 0.1*omega) + push"},
        output={"range": "hypot(2 - sin(phi), cos(phi)) + e"},
    )


def f(x: Any, w: Any) -> Any:
    phi, omega = x
    return [phi + 0.02 * omega, omega + 0.02 * (-9.81 * np.sin(phi) - 0.1 * omega) + w[0]]


def h(x: Any, v: Any) -> Any:
    return np.hypot(2 - np.sin(x["phi"]), x["phi"].cos()) + v["e"]


def test_a_traced_function_is_the_system_of_its_text() -> None:
    traced, text = zb.System.trace(f, h, **PENDULUM), written()
    points = np.random.default_rng(1).uniform(-2, 2, (50, 2))
    for x in points:
        assert np.array_equal(traced.f(x, w=[0.01]), text.f(x, w=[0.01]))
        assert np.array_equal(traced.h(x), text.h(x))
        assert np.array_equal(traced.jacobian(x), text.jacobian(x))
        box = zb.Box(x - 0.1, x + 0.1)
        assert traced.f(box) == text.f(box)
        assert np.array_equal(traced.f(x), f(x, [0.0])), "libm and numpy may differ in the last bit on other machines"


def test_a_value_used_twice_is_written_once() -> None:
    def doubling(x: Any) -> Any:
        a = np.sin(x[0])
        for _ in range(60):
            a = a * 0.5 + a * 0.25
        return [a]

    system = zb.System.trace(doubling, lambda x: x, x=["a"])
    assert len(system.to_json()) < 5000
    assert system.f([0.3])[0] == pytest.approx(math.sin(0.3) * 0.75**60, rel=1e-12)


def test_a_long_loop_is_not_too_deep() -> None:
    def long(x: Any) -> Any:
        a = x[0]
        for _ in range(1000):
            a = np.sin(a) + x[0]
        return [a]

    assert zb.System.trace(long, lambda x: x, x=["a"]).f([0.1]).shape == (1,)


def test_a_square_is_a_square() -> None:
    box = zb.Box([-1.0], [2.0])
    for square in (lambda x: [x[0] * x[0]], lambda x: [x[0] ** 2], lambda x: [np.square(x[0])], lambda x: x * x):
        assert zb.System.trace(square, lambda x: x, x=["a"]).f(box)[0].lo >= -1e-300


def test_signs_and_powers_are_written_as_they_were_meant() -> None:
    cases = {
        lambda a, b: -(a**2): lambda a, b: -(a**2),
        lambda a, b: (-a) ** 2: lambda a, b: a**2,
        lambda a, b: a - (b - a): lambda a, b: 2 * a - b,
        lambda a, b: a / (b / a): lambda a, b: a * a / b,
        lambda a, b: -2.0 * a - -3.0 * b: lambda a, b: -2 * a + 3 * b,
        lambda a, b: 2.0**a: lambda a, b: 2.0**a,
        lambda a, b: a ** (b + 1): lambda a, b: a ** (b + 1),
        lambda a, b: (a**b) ** 2.0: lambda a, b: a ** (2 * b),
        lambda a, b: np.minimum(a, 0.5) + np.maximum(0.25, b) + abs(a - b): lambda a, b: min(a, 0.5) + max(0.25, b) + abs(a - b),
        lambda a, b: np.arctan2(a, b) + np.arctan2(1.0, b) + np.log1p(a): lambda a, b: (
            math.atan2(a, b) + math.atan2(1.0, b) + math.log1p(a)
        ),
        lambda a, b: sum([a, b]) + np.exp(a) + np.expm1(b) + np.arcsinh(a): lambda a, b: (
            a + b + math.exp(a) + math.expm1(b) + math.asinh(a)
        ),
        lambda a, b: np.float64(2.0) * a + np.array(3.0) * b: lambda a, b: 2 * a + 3 * b,
    }
    a, b = 0.7, 1.3
    for traced, meant in cases.items():
        system = zb.System.trace(lambda x, t=traced: [t(x[0], x[1]), x[1]], lambda x: [x[0]], x=["a", "b"])
        assert system.f([a, b])[0] == pytest.approx(meant(a, b), rel=1e-14)


def test_matrices_and_inputs_and_time_are_traced() -> None:
    A = np.array([[0.9, 0.2], [0.0, 0.8]])
    system = zb.System.trace(
        lambda x, u, w, k: A @ x + w + np.array([0.0, 1.0]) * u[0] * k, lambda x, v: x[:1] + v, x=["a", "b"], u=["c"], w=["p", "q"], v=["e"]
    )
    assert np.allclose(system.f([1.0, 2.0], u=[3.0], k=2), A @ [1.0, 2.0] + [0.0, 6.0])
    linear = zb.System.trace(lambda x, w: A @ x + w, lambda x, v: x[:1] + v, x=["a", "b"], w=["p", "q"], v=["e"])
    assert linear.is_linear


def test_a_branch_on_a_recorded_value_says_so() -> None:
    with pytest.raises(TypeError, match="no branch"):
        zb.System.trace(lambda x: [x[0] if x[0] > 0 else 0.0], lambda x: x, x=["a"])
    with pytest.raises(TypeError, match="np.sin"):
        zb.System.trace(lambda x: [math.sin(x[0])], lambda x: x, x=["a"])
    with pytest.raises(TypeError, match="no branch"):
        zb.System.trace(lambda x: [max(x[0], 0.0)], lambda x: x, x=["a"])


def test_a_rate_is_traced_with_its_method() -> None:
    system = zb.System.trace(lambda x: [-x[0]], lambda x: x, x=["a"], rate=True, method="rk4", period=0.1)
    assert system.f([1.0])[0] == pytest.approx(math.exp(-0.1), abs=1e-7)


def test_sympy_expressions_are_equations_to_the_last_bit() -> None:
    sympy = pytest.importorskip("sympy")
    phi, omega, push = sympy.symbols("phi omega push")
    third = 1.0 / 3.0
    system = zb.System.equations(
        x=["phi", "omega"],
        w=["push"],
        next=[phi + third * omega, omega - sympy.sin(phi) ** 2 / 7 + sympy.Abs(phi) * sympy.Float(0.1) + push],
        output={"y": sympy.sqrt(phi**2 + 1) + sympy.Max(omega, 0)},
    )
    assert system.f([0.0, 1.0])[0] == third
    assert system.h([0.5, 2.0])[0] == pytest.approx(math.sqrt(1.25) + 2.0, rel=1e-15)
    wide = sympy.Float(third) * phi
    assert zb.System.equations(x=["phi"], next=[wide], output={"y": phi}).f([1.0])[0] == third


def test_a_mistake_is_named_with_its_place_and_the_nearest_name() -> None:
    with pytest.raises(zb.Error, match=r"next.phi, column 7: .* got \"omeg\" \[did you mean omega\?\]"):
        zb.System.equations(x=["phi", "omega"], next=["phi + omeg", "omega"], output={"y": "phi"})


def test_values_and_derivatives_over_a_box_contain_those_of_its_points() -> None:
    for system, u in [
        (written(), None),
        (zb.System.raimondo(), None),
        (zb.System.van_der_pol(0.1), None),
        (zb.System.vehicle_se2(0.01, "group"), [0.4, 8.0]),
    ]:
        n = len(system.x)
        rng = np.random.default_rng(2)
        box = zb.Box(np.full(n, 0.2), np.full(n, 0.5))
        image, (lower, upper) = system.f(box, u=u), system.jacobian(box, u=u)
        measured = system.h(box, u=u)
        for x in rng.uniform(0.2, 0.5, (100, n)):
            assert system.f(x, u=u) in image
            assert system.h(x, u=u) in measured
            # The derivative at a point is rounded to nearest, hence the last bits.
            j = system.jacobian(x, u=u)
            slack = 1e-12 * np.abs(j)
            assert np.all(lower - slack <= j) and np.all(j <= upper + slack)


def test_noise_may_be_a_box_too() -> None:
    system = written()
    box = system.f([0.3, 0.0], w=zb.Box([-0.01], [0.01]))
    assert system.f([0.3, 0.0], w=[0.01]) in box and box.widths[1] < 0.0201


def test_an_equation_that_leaves_its_domain_says_which_term() -> None:
    system = zb.System.equations(x={"level": "m"}, next=["level - 0.02*sqrt(level)"], output={"y": "level"})
    with pytest.raises(zb.Error, match=r"`sqrt\(level\)` in next.level"):
        system.f(zb.Box([-0.1], [1.0]))


@pytest.mark.parametrize(
    "system",
    [
        zb.System.linear([[0.5]], C=[[1.0]]),
        zb.System.lpv(0.5 * np.eye(2), [0.1 * np.eye(2)], C=[[1.0, 0.0]]),
        zb.System.van_der_pol(0.1),
        zb.System.raimondo("printed", "none"),
        zb.System.vehicle_se2(0.01),
        zb.System.quadrotor(m=0.5, l=0.2, ixx=0.1, iyy=0.1, izz=0.2, g=9.81, dt=0.01),
        zb.System.unicycle(t0=1.0, phi_omega=0.3, phi_theta=0.1, landmarks=[[5, 15]]),
        written(),
    ],
    ids=lambda s: s.kind,
)
def test_a_system_comes_back_from_a_pickle(system: zb.System) -> None:
    again = pickle.loads(pickle.dumps(system))
    assert again == system and again.x == system.x
    assert zb.System.from_json(system.to_json()) == system


def test_what_could_be_written_tighter_is_said() -> None:
    system = zb.System.equations(x=["a"], next=["a*a"], output={"y": "a"})
    assert len(system.warnings) == 1 and "a^2" in system.warnings[0]
