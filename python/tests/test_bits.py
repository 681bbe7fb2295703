"""The same bits as `zonobench track`: experiments of all five papers, each table compared number for number."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import zonobench as zb

from conftest import ROOT

if sys.version_info < (3, 11):
    pytest.skip("tomllib came with Python 3.11", allow_module_level=True)
import tomllib

pq = pytest.importorskip("pyarrow.parquet")

CASES = [
    ("box/scenario-a", 60),
    ("ezgkf/lpv", 40),
    ("ezgkf/van-der-pol", 40),
    ("inzsmf/guaranteed", 30),
    ("cz/taylor", 5),
    ("cz/radii", 6),
    ("cz/quadrotor", 2),
    ("bundle/ex1", 4),
    ("bundle/landmarks", 3),
]


def system_of(given: dict[str, Any]) -> zb.System:
    given = dict(given)
    kind = given.pop("kind")
    if kind == "linear":
        return zb.System.linear(given["a"], given.get("b"), given["c"], given.get("d"))
    if kind == "lpv":
        return zb.System.lpv(given["a0"], given["a"], given.get("b"), given["c"])
    if kind == "equations":
        return zb.System.equations(**given)
    make = {
        "van-der-pol": zb.System.van_der_pol,
        "raimondo": zb.System.raimondo,
        "vehicle-se2": zb.System.vehicle_se2,
        "quadrotor": zb.System.quadrotor,
        "unicycle": zb.System.unicycle,
    }[kind]
    return make(**given)


def uncertain_of(given: dict[str, Any]) -> zb.Uncertain:
    part: zb.Set | None = None
    if "box" in given:
        box = np.array(given["box"])
        part = zb.Box(box[:, 0], box[:, 1])
    elif "generators" in given:
        g = np.array(given["generators"], dtype=float)
        c = given.get("center", np.zeros(len(g)))
        part = zb.Zonotope(c, g)
        if "constraints" in given:
            part = zb.ConstrainedZonotope(c, g, given["constraints"]["a"], given["constraints"]["b"])
    return zb.Uncertain(part, mean=given.get("mean"), covariance=given.get("covariance"))


def csv(path: Path, prefix: str, rows: Any) -> None:
    header = ",".join(["k", *(f"{prefix}{i}" for i in range(1, rows.shape[1] + 1))])
    lines = [",".join([str(k), *("" if np.isnan(x) else repr(float(x)) for x in row)]) for k, row in enumerate(rows)]
    path.write_text("\n".join([header, *lines]) + "\n")


@pytest.mark.parametrize(("name", "steps"), CASES, ids=[name for name, _ in CASES])
def test_a_run_has_the_bits_of_the_program(name: str, steps: int, program: str, tmp_path: Path) -> None:
    # Without its sweep and cases: the file as it stands is one experiment.
    text = (ROOT / "experiments" / f"{name}.toml").read_text()
    text = re.split(r"^\[+(?:metric|sweep|case|output|figure)\b", text, maxsplit=1, flags=re.MULTILINE)[0]
    file = tmp_path / "experiment.toml"
    file.write_text(text)
    given = tomllib.loads(text)
    problem = zb.Problem(
        system_of(given["system"]),
        uncertain_of(given["prior"]),
        uncertain_of(given["noise"]["w"]),
        uncertain_of(given["noise"]["v"]),
    )
    # Any measurements do, as long as the filters go on: those of a true state in the middle of what is known of it.
    p, n = len(problem.system.u), len(problem.system.x)
    constant = given.get("inputs", {}).get("constant", [0.5] * p) or [0.5] * p
    prior = given["prior"]
    start = prior.get("center") or prior.get("mean") or np.mean(prior["box"], axis=1)
    truth = zb.simulate(
        problem, steps, seed=1, x0=start, u=constant if p else None, w="zero", v="zero"
    )
    y = truth.y.copy()
    y[steps // 2, 0] = np.nan
    csv(tmp_path / "y.csv", "y", y)
    arguments = [program, "track", str(file), "--measurements", str(tmp_path / "y.csv"), "--out", str(tmp_path / "out")]
    if p:
        csv(tmp_path / "u.csv", "u", truth.u)
        arguments += ["--inputs", str(tmp_path / "u.csv")]
    subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL)
    tables = sorted((tmp_path / "out").rglob("estimates.parquet"))
    assert len(tables) == 1, "an experiment without a sweep"
    theirs = pq.read_table(tables[0]).to_pylist()
    compared = 0
    for spec in given["estimator"]:
        settings = {key: value for key, value in spec.items() if key not in ("id", "kind", "prior", "noise")}
        own = problem
        if "prior" in spec or "noise" in spec:
            noise = {**given["noise"], **spec.get("noise", {})}
            own = zb.Problem(
                problem.system,
                uncertain_of({**given["prior"], **spec.get("prior", {})}),
                uncertain_of(noise["w"]),
                uncertain_of(noise["v"]),
            )
        cls = next(c for c in vars(zb).values() if isinstance(c, type) and getattr(c, "name", None) == spec["kind"])
        run = zb.track(cls(own, **settings), y, truth.u if p else None)
        columns = run.columns()
        ours = {
            (k, phase, component): (number(c), number(lo), number(hi), status)
            for k, phase, component, c, lo, hi, status in zip(
                *(columns[key] for key in ("k", "phase", "component", "center", "lower", "upper", "status")), strict=True
            )
        }
        rows = [row for row in theirs if row["estimator"] == spec["id"]]
        assert rows, spec["id"]
        for row in rows:
            expected = (row["center"], row["lower"], row["upper"], row["status"])
            got = ours.get((row["k"], row["phase"], row["component"]))
            assert got == expected, f"{spec['id']}, k = {row['k']}, {row['phase']}, {row['component']}"
            compared += 1
        # An update that says what the prediction said has no row of its own.
        missing = set(ours) - {(row["k"], row["phase"], row["component"]) for row in rows}
        assert all(phase == "updated" for _, phase, _ in missing), spec["id"]
    assert compared >= len(given["estimator"]) * n * 2


def number(x: float) -> float | None:
    return None if np.isnan(x) else float(x)
