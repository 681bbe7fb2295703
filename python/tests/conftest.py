"""What the tests share: a small linear system and a pendulum, and where the program is."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

import zonobench as zb

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def cart() -> zb.Problem:
    """Position and speed, the position measured, pushed by an input."""
    system = zb.System.linear([[1.0, 0.1], [0.0, 0.95]], B=[[0.0], [0.1]], C=[[1.0, 0.0]])
    return zb.Problem(
        system,
        zb.Uncertain(zb.Box([-1, -1], [1, 1]), mean=[0, 0], covariance=0.1 * np.eye(2)),
        w=zb.Uncertain(zb.Box([-0.01, -0.02], [0.01, 0.02]), covariance=np.diag([1e-5, 4e-5])),
        v=zb.Uncertain(zb.Box([-0.05], [0.05]), covariance=[[3e-4]]),
    )


@pytest.fixture
def pendulum() -> zb.Problem:
    """The pendulum of docs/systems.md."""
    system = zb.System.equations(
        x={"phi": "rad", "omega": "rad/s"},
        w={"push": "rad/s"},
        v={"e": "m"},
        parameters={"T": 0.02, "g": 9.81, "l": 1.0, "drag": 0.1},
        let={"a": "-g/l*sin(phi) - drag*omega"},
        next={"phi": "phi + T*omega", "omega": "omega + T*a + push"},
        output={"range": "hypot(2 - l*sin(phi), l*cos(phi)) + e"},
        y={"range": "m"},
        period=0.02,
    )
    return zb.Problem(
        system, zb.Box([0.2, -0.1], [0.4, 0.1]), w=zb.Box([-0.002], [0.002]), v=zb.Box([-0.01], [0.01])
    )


@pytest.fixture
def raimondo() -> zb.Problem:
    """Example 1 of [Rego2020]."""
    return zb.Problem(
        zb.System.raimondo(),
        zb.Zonotope([0.5, 0.5], [[0.1, 0.2, -0.1], [0.1, 0.1, 0.0]]),
        w=zb.Box([-0.4, -0.4], [0.4, 0.4]),
        v=zb.Box([-0.4, -0.4], [0.4, 0.4]),
    )


@pytest.fixture
def program() -> str:
    """The program `zonobench`: of the wheel, of the variable ZONOBENCH_PROGRAM, or what cargo built."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    found = os.environ.get("ZONOBENCH_PROGRAM") or shutil.which("zonobench")
    built = target / "debug" / "zonobench"
    if not found and built.exists():
        found = str(built)
    if not found:
        if os.environ.get("CI"):
            pytest.fail("the program zonobench is not there, and CI is to have it")
        pytest.skip("the program zonobench is not there: cargo build")
    return found
