#!/usr/bin/env python3
"""Times other tools on the sets of `peers sets`, and compares their hulls with the exact ones.

    run.py SETS.json > rows.csv

Times are taken inside Python, around calls of the compiled libraries; the rows `empty call` say what a call costs
by itself. A tool that is not installed or fails is left out, which stderr says. Points are checked here once more,
in fractions: A xi = b and |xi| <= 1 without error.
"""

import gc
import importlib.metadata
import json
import os
import sys
import time
from fractions import Fraction
from itertools import groupby

import numpy as np
from scipy.sparse import csc_matrix

BUDGET = 0.6  # seconds an operation of a size is timed for, at least three passes

# Rows go where stdout was; what the libraries print goes to stderr.
OUT = os.fdopen(os.dup(1), "w", encoding="utf-8")
os.dup2(2, 1)


class Case:
    """A set with what is asked about it; `ends` are its exact (upper, lower) along each axis."""

    def __init__(self, raw):
        self.size = (raw["n"], raw["generators"], raw["constraints"])
        for name in ("c", "g", "a", "b", "direction", "map", "output"):
            setattr(self, name, np.array(raw[name]))
        self.y = [np.array(y) for y in raw["y"]]
        self.noise = raw["noise"]
        values = [self.end(i // 2, xi) for i, xi in enumerate(raw["ends"])]
        self.ends = list(zip(values[::2], values[1::2]))

    def end(self, axis, xi):
        """c + G xi along an axis, once xi is known to be a point of the set."""
        xi = [Fraction(x) for x in xi]
        exact = lambda row: sum(Fraction(a) * x for a, x in zip(row.tolist(), xi) if a)
        assert all(abs(x) <= 1 for x in xi), "expected |xi| <= 1"
        for row, b in zip(self.a, self.b.tolist()):
            assert exact(row) == Fraction(b), "expected A xi = b"
        return Fraction(self.c.tolist()[axis]) + exact(self.g[axis])

    def off(self, hull):
        """The greatest part of the width that `hull` cuts off, and that it has too much."""
        cut, excess = Fraction(0), Fraction(0)
        for (hi, lo), (top, bottom) in zip(hull, self.ends):
            for beyond in (Fraction(float(hi)) - top, bottom - Fraction(float(lo))):
                part = beyond / (top - bottom)
                cut, excess = max(cut, -part), max(excess, part)
        return cut, excess


def timed(each, passing):
    """(samples, min, median, 10 %, 90 %) in µs an operation; a sample is a pass over all cases.

    The first pass counts too: only a warm-up of a fast one would not be seen among many.
    """
    samples, begin = [], time.perf_counter()
    gc.disable()
    while len(samples) < 3 or time.perf_counter() - begin < BUDGET:
        start = time.perf_counter()
        passing()
        samples.append((time.perf_counter() - start) * 1e6 / each)
    gc.enable()
    samples.sort()
    at = lambda part: samples[round(part * (len(samples) - 1))]
    return (len(samples), samples[0], at(0.5), at(0.1), at(0.9))


class Tool:
    """Rows of one tool."""

    def __init__(self, name, package):
        self.name, self.version = name, importlib.metadata.version(package)

    def row(self, operation, size, times, remark="", hulls=None):
        cells = [self.name, self.version, operation, *size, times[0], *(f"{t:.3f}" for t in times[1:])]
        if hulls is None:
            cells += ["", "", "", ""]
        else:
            cut = [c for c, _ in hulls]
            cells += [len(hulls), sum(c > 0 for c in cut), f"{float(max(cut)):.2e}"]
            cells.append(f"{float(max(e for _, e in hulls)):.2e}")
        print(",".join(str(c) for c in [*cells, remark]), file=OUT, flush=True)

    def each(self, operation, cases, f, remark="", size=None):
        """Times f(case) over the cases."""
        self.row(operation, size or cases[0].size, timed(len(cases), lambda: [f(c) for c in cases]), remark)

    def hulls(self, cases, f, remark=""):
        """Times f(case) = [(upper, lower)] and compares it with the exact hull."""
        found = [f(c) for c in cases]
        times = timed(len(cases), lambda: [f(c) for c in cases])
        self.row("interval hull", cases[0].size, times, remark, [c.off(hull) for c, hull in zip(cases, found)])

    def empty(self, f):
        """What a call from Python costs by itself."""
        self.row("empty call", (0, 0, 0), timed(1000, lambda: [f() for _ in range(1000)]), "the binding alone")


def zonoopt(sizes):
    """ZonoOpt by its own ADMM solver, with its default tolerances and with small ones."""
    import zonoopt as z

    fine = z.OptSettings()
    fine.eps_prim = fine.eps_dual = 1e-8
    fine.k_max_admm = 1_000_000  # with the default of 5000 some programs would end early
    for name, settings in (("ZonoOpt", None), ("ZonoOpt 1e-8", fine)):
        tool = Tool(name, "zonoopt")
        for cases in sizes:
            if settings and cases[0].size[0] > 2:
                cases = cases[:10]  # half a second each
            for case in cases:
                case.set = z.ConZono(csc_matrix(case.g), case.c, csc_matrix(case.a), case.b)
                case.maps = csc_matrix(case.map), csc_matrix(case.output)
                n, m = case.map.shape[0], case.output.shape[0]
                box = lambda c, half, k: z.Zono(csc_matrix(np.eye(k) * half), c)
                case.w = box(np.zeros(n), case.noise[0], n)
                case.v = [box(y, case.noise[1], m) for y in case.y]

            def hull(set):
                box = set.bounding_box(settings)
                return list(zip(box.upper(), box.lower()))

            def cut(case, set, v):
                set = z.intersection(set, v, case.maps[1])
                for _ in case.y[0]:
                    set = set.constraint_reduction()
                return set

            def step(case):
                return cut(case, z.minkowski_sum(z.affine_map(case.set, case.maps[0]), case.w), case.v[1])

            tool.hulls(cases, lambda c: hull(c.set), "2n programs")
            tool.each("support", cases, lambda c: c.set.support(c.direction, settings))
            left = lambda set: f"constraints alone; {set.get_nG()} generators and {set.get_nC()} constraints left"
            if settings is None:
                remark = left(cut(cases[0], cases[0].set, cases[0].v[0]))
                tool.each("intersection and reduction", cases, lambda c: cut(c, c.set, c.v[0]), remark)
                tool.each("step", cases, step, left(step(cases[0])))
                tool.each("step and hull", cases, lambda c: hull(step(c)), left(step(cases[0])))
    Tool("ZonoOpt", "zonoopt").empty(sizes[0][0].set.get_n)


def highs(sizes):
    """HiGHS: one model a set, the cost changed from one program to the next, warm simplex; no presolve and one
    thread, with which it is fastest here."""
    import highspy

    solver = highspy.Highs()
    for option in (("output_flag", False), ("solver", "simplex"), ("presolve", "off"), ("threads", 1)):
        solver.setOptionValue(*option)
    tool = Tool("HiGHS", "highspy")

    def load(case):
        rows, columns = case.a.shape
        model = highspy.HighsLp()
        model.num_col_, model.num_row_ = columns, rows
        model.col_cost_ = np.zeros(columns)
        model.col_lower_, model.col_upper_ = -np.ones(columns), np.ones(columns)
        model.row_lower_ = model.row_upper_ = case.b
        model.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
        model.a_matrix_.start_ = np.arange(rows + 1) * columns
        model.a_matrix_.index_ = np.tile(np.arange(columns), rows)
        model.a_matrix_.value_ = case.a.ravel()
        model.sense_ = highspy.ObjSense.kMaximize
        return model

    def end(columns, cost):
        solver.changeColsCost(len(columns), columns, cost)
        solver.run()
        return solver.getObjectiveValue()

    def hull(case):
        solver.passModel(case.model)
        ends = zip(case.c, case.g)
        return [(c + end(case.columns, g), c - end(case.columns, -g)) for c, g in ends]

    def support(case):
        solver.passModel(case.model)
        return case.direction @ case.c + end(case.columns, case.direction @ case.g)

    for cases in sizes:
        for case in cases:
            case.model, case.columns = load(case), np.arange(case.a.shape[1], dtype=np.int32)
        tool.hulls(cases, hull, "2n programs; warm simplex")
        tool.each("support", cases, support)
    tool.empty(solver.getNumCol)


def codac(sizes):
    """Codac has no constrained zonotope: hull, support and steps cannot be asked of it, boxes of zonotopes can."""
    import codac as k

    tool = Tool("Codac", "codac")
    for cases in sizes:
        n, p, _ = cases[0].size
        for case in cases:
            case.zonotope = k.Zonotope(k.Vector(case.c), k.Matrix(case.g))
        tool.each("box of a zonotope", cases, lambda c: c.zonotope.box(), size=(n, p, 0))
    x = k.VectorVar(2)
    f1 = k.AnalyticFunction([x], 3 * x[0] - k.sqr(x[0]) / 7 - 4 * x[1] * (1 - 4 / (4 + x[0])))
    over = k.IntervalVector([[2, 2.4], [0.9, 1.1]])
    tool.row("f1 over a box", (2, 0, 0), timed(1000, lambda: [f1.eval(over) for _ in range(1000)]))
    tool.empty(over.size)


def main(file):
    with open(file, encoding="utf-8") as text:
        cases = [Case(raw) for raw in json.load(text)]
    sizes = [list(group) for _, group in groupby(cases, key=lambda case: case.size)]
    for peer in (highs, codac, zonoopt):
        try:
            peer(sizes)
        except Exception as fault:  # a tool that is not there or fails leaves the others their turn
            print(f"left out: {peer.__name__} ({type(fault).__name__}: {fault})", file=sys.stderr)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("expected one argument, the file of the sets")
    main(sys.argv[1])
