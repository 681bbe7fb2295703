#!/usr/bin/env python3
"""Values of the elementary functions at 300 bits, rounded down to an f64, over the whole range of their arguments.

    python3 elementary.py > elementary.json     (mpmath 1.3.0)

A row is the argument (two for atan2, hypot and pow), the largest f64 at or below the exact value, and 1 where it is the
value itself; f64s as the hexadecimal digits of their bits. Values beyond the largest f64 are left out.
"""

import json
import math
import random
import struct

import mpmath as mp

mp.mp.prec = 300
draw = random.Random(2026)
TINY, HUGE = 5e-324, 1.7976931348623157e308


def bits(x):
    return struct.pack(">d", x).hex()


def floor(value):
    """The largest f64 at or below `value`, and whether it is equal."""
    x = float(value)
    if math.isinf(x):
        return None
    if mp.mpf(x) > value:
        x = math.nextafter(x, -math.inf)
    while mp.mpf(math.nextafter(x, math.inf)) <= value:
        x = math.nextafter(x, math.inf)
    return x, mp.mpf(x) == value


def around(*points):
    out = []
    for p in points:
        out += [p, math.nextafter(p, -math.inf), math.nextafter(p, math.inf), p + 1e-9, p - 1e-9]
    return out


def spread(n, low, high, signs=True):
    """n magnitudes whose exponents are uniform between those of low and high."""
    out = []
    for _ in range(n):
        x = math.ldexp(draw.uniform(1, 2), draw.randint(math.frexp(low)[1] - 1, math.frexp(high)[1] - 2))
        out.append(-x if signs and draw.random() < 0.5 else x)
    return out


def uniform(n, low, high):
    return [draw.uniform(low, high) for _ in range(n)]


LINE = spread(60, TINY, HUGE) + [TINY, -TINY, 2.2250738585072014e-308, HUGE, -HUGE, 0.0]
POSITIVE = spread(120, TINY, HUGE, False) + [TINY, 2.2250738585072014e-308, HUGE] + around(1.0, 2.0, math.e, 10.0, 1000.0)
one = {
    "exp": (mp.exp, LINE + spread(80, 1e-8, 700) + uniform(60, -745, 709.7) + around(0.0, 0.34657359, 1.0397, -708.4, -745.1, 709.78)),
    "exp_m1": (mp.expm1, LINE + spread(80, 1e-8, 700) + uniform(60, -50, 709.7) + around(0.0, 0.34657359, 1.0397, -37.0, 38.8)),
    "ln": (mp.log, POSITIVE + uniform(60, 0.5, 2)),
    "log10": (mp.log10, POSITIVE + uniform(60, 0.5, 2)),
    "ln_1p": (mp.log1p, [x for x in LINE if x > -1] + uniform(60, -1, 2) + spread(60, 1e-18, 1e20, False) + around(0.0, 0.41421356, -0.29289)),
    "asin": (mp.asin, spread(60, TINY, 0.5) + uniform(80, -1, 1) + [1.0, -1.0, 0.0, math.nextafter(1, 0)] + around(0.5, -0.5, 0.975)),
    "acos": (mp.acos, spread(60, TINY, 0.5) + uniform(80, -1, 1) + [1.0, -1.0, 0.0, math.nextafter(1, 0)] + around(0.5, -0.5, 0.975)),
    "sinh": (mp.sinh, LINE + spread(80, 1e-8, 700) + uniform(60, -711, 711) + around(0.0, 1.0, 22.0, 709.78, 710.4)),
    "cosh": (mp.cosh, LINE + spread(80, 1e-8, 700) + uniform(60, -711, 711) + around(0.0, 0.6931, 22.0, 709.78, 710.4)),
    "tanh": (mp.tanh, LINE + spread(120, 1e-8, 40) + around(0.0, 0.5493, 0.2554, 20.0, 22.0)),
    "asinh": (mp.asinh, LINE + spread(120, 1e-9, 1e10) + around(0.0, 2.0, 0.5)),
}
two = {
    "atan2": (mp.atan2, [(y, x) for x, y in zip(spread(150, TINY, HUGE), spread(150, TINY, HUGE))]
              + [(y, x) for x, y in zip(spread(150, 1e-3, 1e3), spread(150, 1e-3, 1e3))]),
    "hypot": (mp.hypot, list(zip(spread(120, TINY, HUGE), spread(120, TINY, HUGE))) + list(zip(spread(120, 1e-3, 1e3), spread(120, 1e-3, 1e3)))),
    "pow": (mp.power, list(zip(spread(150, 1e-3, 1e3, False), uniform(150, -20, 20)))
            + list(zip(spread(100, TINY, HUGE, False), uniform(100, -1.5, 1.5))) + list(zip(uniform(60, 0.9, 1.1), spread(60, 1, 1e3)))),
}
out = {"tool": "mpmath", "version": mp.__version__, "bits": mp.mp.prec, "command": "python3 elementary.py > elementary.json"}
rows = {}
for name, (f, arguments) in one.items():
    rows[name] = []
    for x in arguments:
        if name in ("asin", "acos") and abs(x) > 1:
            continue
        value = floor(f(mp.mpf(x)))
        if value is not None:
            rows[name].append(" ".join([bits(x), bits(value[0]), str(int(value[1]))]))
for name, (f, arguments) in two.items():
    rows[name] = []
    for x, y in arguments:
        value = floor(f(mp.mpf(x), mp.mpf(y)))
        if value is not None:
            rows[name].append(" ".join([bits(x), bits(y), bits(value[0]), str(int(value[1]))]))
out["rows"] = rows
print(json.dumps(out, indent=0))
