"""A Python function as a system: it is called once with recording objects, and what they record becomes the equations.

The carrier is the equations' text: each recording object is an expression of docs/systems.md, and the whole goes to
`System.equations`. A value that is used more than once becomes a definition, so that the text stays as short as the function.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NoReturn

import numpy as np

from . import _ufunc
from ._native import Error, System

#: How deep an expression may be before a part of it becomes a definition: the language allows 200 levels.
DEEP = 40

#: Precedence: sum, product, sign, power, atom.
SUM, PRODUCT, SIGN, POWER, ATOM = range(5)


class Recorded:
    """A value of which only the operations are known.

    It has numbers' arithmetic, `abs`, numpy's functions (`np.sin(x)`, `np.minimum(x, y)`) and the same as methods (`x.sin()`).
    It has no truth value and no number: a branch on it raises `TypeError`.
    """

    __slots__ = ("operation", "arguments")

    def __init__(self, operation: str, arguments: tuple[Any, ...] = ()):
        self.operation = operation
        self.arguments = arguments

    def lift(self, number: Any) -> Recorded:
        """A number as a recorded one."""
        value = number.item() if isinstance(number, np.generic) else number
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise TypeError(f"trace: expected a real number beside a recorded value, got {type(number).__name__}")
        if isinstance(value, int) and int(float(value)) != value or not np.isfinite(value):
            raise Error(f"trace: expected a finite number that a double holds exactly, got {number}")
        return Recorded("number", (float(value),))

    def _with(self, operation: str, other: Any, reversed_: bool = False) -> Any:
        if isinstance(other, np.ndarray) and other.ndim:
            return NotImplemented
        if not isinstance(other, Recorded):
            try:
                other = self.lift(other)
            except TypeError:
                return NotImplemented
        if operation == "*" and other is self:
            return self.sqr()
        return Recorded(operation, (other, self) if reversed_ else (self, other))

    def __add__(self, other: Any) -> Any:
        # sum() begins with 0, which adds nothing.
        return self if isinstance(other, int) and other == 0 else self._with("+", other)

    def __radd__(self, other: Any) -> Any:
        return self if isinstance(other, int) and other == 0 else self._with("+", other, True)

    def __sub__(self, other: Any) -> Any:
        return self._with("-", other)

    def __rsub__(self, other: Any) -> Any:
        return self._with("-", other, True)

    def __mul__(self, other: Any) -> Any:
        return self._with("*", other)

    def __rmul__(self, other: Any) -> Any:
        return self._with("*", other, True)

    def __truediv__(self, other: Any) -> Any:
        return self._with("/", other)

    def __rtruediv__(self, other: Any) -> Any:
        return self._with("/", other, True)

    def __pow__(self, other: Any) -> Any:
        return self._with("^", other)

    def __rpow__(self, other: Any) -> Any:
        return self._with("^", other, True)

    def __neg__(self) -> Recorded:
        return Recorded("neg", (self,))

    def __pos__(self) -> Recorded:
        return self

    def __abs__(self) -> Recorded:
        return Recorded("abs", (self,))

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        return _ufunc.apply(ufunc, method, inputs, kwargs)

    def _function(self, name: str, *others: Any) -> Recorded:
        lifted = tuple(o if isinstance(o, Recorded) else self.lift(o) for o in others)
        return Recorded(name, (self, *lifted))

    def atan2(self, x: Any) -> Recorded:
        return self._function("atan2", x)

    def hypot(self, y: Any) -> Recorded:
        return self._function("hypot", y)

    def min(self, y: Any) -> Recorded:
        return self._function("min", y)

    def max(self, y: Any) -> Recorded:
        return self._function("max", y)

    def refuse(self, *_: Any) -> NoReturn:
        """Raises: a system has no branch on a state."""
        raise TypeError(
            "trace: a recorded value has no truth value and no number: a system has no branch on it. Use np.minimum, np.maximum "
            "or np.abs for a kink, and np.sin(x) in place of math.sin(x)"
        )

    __bool__ = __float__ = __int__ = __index__ = __complex__ = refuse
    __lt__ = __le__ = __gt__ = __ge__ = refuse
    __floordiv__ = __rfloordiv__ = __mod__ = __rmod__ = __round__ = __trunc__ = refuse

    def __eq__(self, other: object) -> NoReturn:
        self.refuse()

    def __ne__(self, other: object) -> NoReturn:
        self.refuse()

    __hash__ = object.__hash__

    def __repr__(self) -> str:
        return f"Recorded({self.operation})"


def _method(name: str) -> Callable[[Recorded], Recorded]:
    def method(self: Recorded) -> Recorded:
        return self._function(name)

    method.__name__ = name
    return method


_FUNCTIONS = ["sqr", "sqrt", "exp", "exp_m1", "ln", "log10", "ln_1p", "sin", "cos", "tan", "asin", "acos", "atan"]
_FUNCTIONS += ["sinh", "cosh", "tanh", "asinh"]
for _name in _FUNCTIONS:
    setattr(Recorded, _name, _method(_name))
# What numpy looks for on the entries of an array of objects.
for _theirs, _ours in [("arcsin", "asin"), ("arccos", "acos"), ("arctan", "atan"), ("arcsinh", "asinh")]:
    setattr(Recorded, _theirs, _method(_ours))
for _theirs, _ours in [("log", "ln"), ("expm1", "exp_m1"), ("log1p", "ln_1p"), ("arctan2", "atan2")]:
    setattr(Recorded, _theirs, getattr(Recorded, _ours))


class Vector(np.ndarray[Any, Any]):
    """Recorded values by number and by name: x[0], x["phi"]."""

    names: list[str]

    def __getitem__(self, at: Any) -> Any:
        if isinstance(at, str):
            if at not in self.names:
                raise KeyError(f"{at!r}: the vector has {', '.join(self.names)}")
            at = self.names.index(at)
        return np.asarray(self)[at]


def trace(
    f: Callable[..., Any],
    h: Callable[..., Any],
    *,
    x: Any,
    u: Any = (),
    w: Any = (),
    y: Any = None,
    v: Any = (),
    period: float | None = None,
    rate: bool = False,
    method: str = "euler",
    substeps: int = 1,
) -> System:
    """The system x+ = f(x, u, w), y = h(x, u, v) of two Python functions, each called once with recording objects.

    f and h take those of the arguments x, u, w (h: v), k, t that they name, and return a value for every component, in order.
    Vectors are numpy arrays of recorded values, with names too: x[0], x["phi"]. Numbers, numpy's functions and `A @ x` work as
    usual; a branch on a recorded value raises `TypeError`.

    x, u, w, y, v: names, or {name: unit}. y: unless given, y1, y2, ... With rate=True f is the derivative, and method and
    substeps make a step of it, as in `equations`.

    What the functions compute is what is enclosed, operation by operation; only x*x of one value is taken as its square.
    """
    from ._systems import _named, equations

    vectors = {name: _named(name, given) for name, given in {"x": x, "u": u, "w": w, "v": v}.items()}
    values = {name: _vector([n for n, _ in named]) for name, named in vectors.items()}
    values["k"], values["t"] = Recorded("name", ("k",)), Recorded("name", ("t",))
    motion = _called("f", f, values, ("x", "u", "w", "k", "t"))
    output = _called("h", h, values, ("x", "u", "v", "k", "t"))
    outputs = [[f"y{i}", "1"] for i in range(1, len(output) + 1)] if y is None else _named("y", y)
    if len(motion) != len(vectors["x"]):
        raise Error(f"f: expected {len(vectors['x'])} components, one a state, got {len(motion)}")
    if len(output) != len(outputs):
        raise Error(f"h: expected {len(outputs)} components, one a measurement, got {len(output)}")
    taken = {name for named in (*vectors.values(), outputs) for name, _ in named}
    definitions, texts = _write([*motion, *output], taken)
    equation = dict(zip([name for name, _ in vectors["x"]], texts, strict=False))
    units = {name: _units(named) for name, named in vectors.items()}
    return equations(
        x=units["x"],
        u=units["u"],
        w=units["w"],
        v=units["v"],
        y=_units(outputs),
        next=None if rate else equation,
        rate=equation if rate else None,
        method=method,
        substeps=substeps,
        let=definitions,
        output=dict(zip([name for name, _ in outputs], texts[len(motion) :], strict=True)),
        period=period,
    )


def _units(named: list[list[str]]) -> Mapping[str, str]:
    if len({name for name, _ in named}) != len(named):
        names = [name for name, _ in named]
        raise Error(f"trace: expected names that stand once, got {', '.join(names)}")
    return dict((name, unit) for name, unit in named)


def _vector(names: list[str]) -> Any:
    vector = np.empty(len(names), dtype=object).view(Vector)
    for i, name in enumerate(names):
        np.asarray(vector)[i] = Recorded("name", (name,))
    vector.names = names
    return vector


def _called(name: str, function: Callable[..., Any], values: dict[str, Any], known: tuple[str, ...]) -> list[Any]:
    if not callable(function):
        raise TypeError(f"{name}: expected a function, got {type(function).__name__}")
    parameters = inspect.signature(function).parameters.values()
    wanted = [p for p in parameters if p.default is p.empty and p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    unknown = [p.name for p in wanted if p.name not in known]
    if unknown:
        raise TypeError(f"{name}: expected arguments among {', '.join(known)}, got {', '.join(unknown)}")
    given = function(**{p.name: values[p.name] for p in wanted})
    if isinstance(given, (Recorded, int, float)):
        given = [given]
    try:
        items = list(np.asarray(given, dtype=object).ravel())
    except (TypeError, ValueError):
        items = list(given)
    zero = Recorded("number", (0.0,))
    return [item if isinstance(item, Recorded) else zero.lift(item) for item in items]


def _order(roots: list[Recorded]) -> Iterator[Recorded]:
    """Every value once, arguments before what is made of them; without recursion, because functions may loop long."""
    seen: set[int] = set()
    stack = [(root, False) for root in reversed(roots)]
    while stack:
        value, is_done = stack.pop()
        if is_done:
            yield value
        elif id(value) not in seen:
            seen.add(id(value))
            stack.append((value, True))
            stack.extend((a, False) for a in reversed(value.arguments) if isinstance(a, Recorded))


def _write(roots: list[Recorded], taken: set[str]) -> tuple[dict[str, str], list[str]]:
    """Definitions, and the text of every root."""
    order = list(_order(roots))
    uses: dict[int, int] = {}
    for value in order:
        for argument in value.arguments:
            uses[id(argument)] = uses.get(id(argument), 0) + 1
    texts: dict[int, tuple[str, int, int]] = {}
    definitions: dict[str, str] = {}
    numbers = iter(range(1, len(order) + 2))
    for value in order:
        written, precedence, deep = _text(value, texts)
        is_plain = value.operation in ("name", "number")
        if not is_plain and (uses.get(id(value), 0) > 1 or deep > DEEP):
            name = next(n for n in (f"s{i}" for i in numbers) if n not in taken)
            definitions[name] = written
            written, precedence, deep = name, ATOM, 1
        texts[id(value)] = written, precedence, deep
    return definitions, [texts[id(root)][0] for root in roots]


def _text(value: Recorded, texts: dict[int, tuple[str, int, int]]) -> tuple[str, int, int]:
    operation, arguments = value.operation, value.arguments
    if operation == "name":
        return arguments[0], ATOM, 1
    if operation == "number":
        return repr(arguments[0]), SIGN if arguments[0] < 0 or str(arguments[0])[0] == "-" else ATOM, 1
    parts = [texts[id(a)] for a in arguments]
    deep = 1 + max(deep for _, _, deep in parts)

    def at_least(i: int, precedence: int) -> str:
        written, own, _ = parts[i]
        return written if own >= precedence else f"({written})"

    if operation in "+-":
        return f"{at_least(0, SUM)} {operation} {at_least(1, PRODUCT)}", SUM, deep
    if operation in "*/":
        return f"{at_least(0, PRODUCT)}{operation}{at_least(1, POWER)}", PRODUCT, deep
    if operation == "^":
        return f"{at_least(0, ATOM)}^{at_least(1, ATOM)}", POWER, deep
    if operation == "neg":
        return f"-{at_least(0, POWER)}", SIGN, deep
    return f"{operation}({', '.join(written for written, _, _ in parts)})", ATOM, deep
