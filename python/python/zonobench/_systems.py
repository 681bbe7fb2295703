"""Systems from keywords, from SymPy's expressions, from Python functions."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _json
from ._native import Error, System
from ._trace import trace


def attach(cls: type[System]) -> None:
    """Gives `System` its makers."""
    cls.equations = staticmethod(equations)  # type: ignore[method-assign]
    cls.trace = staticmethod(trace)  # type: ignore[method-assign]
    cls.lpv = staticmethod(lpv)  # type: ignore[method-assign]
    cls.van_der_pol = staticmethod(van_der_pol)  # type: ignore[method-assign]
    cls.raimondo = staticmethod(raimondo)  # type: ignore[method-assign]
    cls.vehicle_se2 = staticmethod(vehicle_se2)  # type: ignore[method-assign]
    cls.quadrotor = staticmethod(quadrotor)  # type: ignore[method-assign]
    cls.unicycle = staticmethod(unicycle)  # type: ignore[method-assign]


def equations(
    *,
    x: Any,
    output: Any,
    next: Any = None,
    rate: Any = None,
    u: Any = (),
    w: Any = (),
    y: Any = None,
    v: Any = (),
    parameters: Mapping[str, float] | None = None,
    let: Any = None,
    method: str = "euler",
    substeps: int = 1,
    period: float | None = None,
) -> System:
    """A system from its equations as text: x+ = next(x, u, w, k), or the derivative rate with a method; y = output(x, u, v, k).

    x, u, w, y, v: names, or {name: unit}. next or rate, and output: {name: expression}, or expressions in the order of x and
    of y; each a text in the language of docs/systems.md, a number, or a SymPy expression. let: {name: expression}, each may use
    those above it. method: "euler", "heun" or "rk4", beside rate. period: time from step to step in s.

    What is written is what is enclosed: nothing is rewritten. Raises `Error` with table, name and column of a mistake.
    """
    if (next is None) == (rate is None):
        raise Error(f"equations: expected either next or rate, got {'neither' if next is None else 'both'}")
    states, outputs = _named("x", x), None if y is None else _named("y", y)
    if outputs is None:
        if not isinstance(output, Mapping):
            raise Error("equations: expected y, or output as {name: expression}, got expressions without names")
        outputs = [[str(name), "1"] for name in output]
    motion: dict[str, Any]
    if rate is None:
        motion = {"next": _texts("next", next, states)}
    else:
        motion = {"rate": {"equations": _texts("rate", rate, states), "method": method, "substeps": substeps}}
    source = {
        "x": states,
        "u": _named("u", u),
        "w": _named("w", w),
        "y": outputs,
        "v": _named("v", v),
        "parameters": [[str(name), _number(name, value)] for name, value in (parameters or {}).items()],
        "definitions": _texts("let", let or {}, None),
        "motion": motion,
        "output": _texts("output", output, outputs),
        "period": None if period is None else _number("period", period),
    }
    try:
        return System._equations(_json.dumps("equations", source))
    except Error as fault:
        raise _with_suggestion(fault) from None


def _with_suggestion(fault: Error) -> Error:
    got, known = getattr(fault, "got", ""), getattr(fault, "known", [])
    near = difflib.get_close_matches(got.strip('"'), known, n=1)
    return Error(f"{fault} [did you mean {near[0]}?]" if near else str(fault))


def _named(table: str, given: Any) -> list[list[str]]:
    if isinstance(given, Mapping):
        return [[str(name), str(unit)] for name, unit in given.items()]
    if isinstance(given, str):
        raise TypeError(f"{table}: expected a list of names, or {{name: unit}}, got a text")
    try:
        return [[str(name), "1"] for name in given]
    except TypeError:
        raise TypeError(f"{table}: expected a list of names, or {{name: unit}}, got {type(given).__name__}") from None


def _texts(table: str, given: Any, names: list[list[str]] | None) -> list[list[str]]:
    if isinstance(given, Mapping):
        return [[str(name), text(value)] for name, value in given.items()]
    if names is None or isinstance(given, str):
        raise TypeError(f"{table}: expected {{name: expression}}, got {type(given).__name__}")
    values = list(given)
    if len(values) != len(names):
        raise Error(f"{table}: expected {len(names)} expressions, got {len(values)}")
    return [[name, text(value)] for (name, _), value in zip(names, values, strict=True)]


def text(expression: Any) -> str:
    """An expression as text: a text as it stands, a number with every digit, a SymPy expression as it prints."""
    if isinstance(expression, (float, np.floating)):
        return repr(float(expression))
    if type(expression).__module__.split(".")[0] == "sympy" or hasattr(expression, "_sympystr"):
        return str(_sympy(expression))
    return str(expression)


def _sympy(expression: Any) -> str:
    from sympy.printing.str import StrPrinter  # type: ignore[import-untyped, unused-ignore]

    class EveryDigit(StrPrinter):  # type: ignore[misc, unused-ignore]
        """SymPy prints fifteen digits; a double may need seventeen."""

        def _print_Float(self, number: Any) -> str:
            return repr(float(number))

    return str(EveryDigit().doprint(expression))


def _number(what: str, given: Any) -> float:
    value = given.item() if isinstance(given, np.generic) else given
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError(f"{what}: expected a number, got {type(given).__name__}")
    return float(value)


def _kind(kind: str, **parameters: Any) -> System:
    given = {name: value for name, value in parameters.items() if value is not None}
    return System.from_json(_json.dumps(kind, {"kind": kind, **given}))


def lpv(A0: Any, A: Any, B: Any = None, C: Any = None) -> System:
    """x+ = (A0 + sum of delta_i A_i) x + B u + w with |delta_i| <= 1, y = C x + v.

    A0: n x n; A: the list of the A_i; B: n x p; C: m x n.
    """
    if C is None:
        raise Error("lpv: expected C, the matrix of the measurement, got none")
    rows = [np.asarray(a, float) for a in A]
    b = None if B is None else np.asarray(B, float)
    return _kind("lpv", a0=np.asarray(A0, float), a=rows, b=b, c=np.asarray(C, float))


def van_der_pol(ts: float) -> System:
    """The Van der Pol oscillator of [dePaula], sampled every ts seconds."""
    return _kind("van-der-pol", ts=ts)


def raimondo(form: str | None = None, output: str | None = None) -> System:
    """Example 1 of [Rego2020]: two states, two measurements. form: "tight", "printed" or "expanded"; output: "both" or "none"."""
    return _kind("raimondo", form=form, output=output)


def vehicle_se2(dt: float, form: str | None = None) -> System:
    """The vehicle of [Li] on SE(2): heading and position, turn rate and speed as inputs. form: "euler" or "group"."""
    return _kind("vehicle-se2", dt=dt, form=form)


def quadrotor(*, m: float, l: float, ixx: float, iyy: float, izz: float, g: float, dt: float) -> System:  # noqa: E741
    """The quadrotor of twelve states of [Rego2020]: mass in kg, arm in m, moments of inertia in kg m2, gravity, period in s."""
    return _kind("quadrotor", m=m, l=l, inertia=[ixx, iyy, izz], g=g, dt=dt)


def unicycle(*, t0: float, phi_omega: float, phi_theta: float, landmarks: Any) -> System:
    """The unicycle of [Khajenejad] that measures distance and bearing of landmarks, rows [x, y]."""
    return _kind("unicycle", t0=t0, phi_omega=phi_omega, phi_theta=phi_theta, landmarks=np.asarray(landmarks, float))
