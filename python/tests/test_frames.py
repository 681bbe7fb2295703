"""Runs and lakes as frames, and pictures."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

import zonobench as zb


@pytest.fixture
def run(pendulum: zb.Problem) -> zb.Track:
    return zb.track(zb.Lift(pendulum), zb.simulate(pendulum, 10, seed=1).y)


def test_a_run_as_a_pandas_frame(run: zb.Track) -> None:
    pytest.importorskip("pandas")
    frame = run.to_pandas()
    assert frame.attrs["units"] == {"phi": "rad", "omega": "rad/s"}
    updated = frame[(frame.phase == "updated") & (frame.component == "omega")]
    assert updated.lower.to_numpy().tolist() == run.updated.lower[:, 1].tolist()


def test_a_run_as_a_polars_frame_and_an_arrow_table(run: zb.Track, cart: zb.Problem) -> None:
    pl = pytest.importorskip("polars")
    frame = run.to_polars().filter(pl.col("phase") == "updated", pl.col("component") == "phi")
    assert frame["upper"].to_list() == run.updated.upper[:, 0].tolist()
    kalman = zb.track(zb.Kalman(cart), np.zeros(3), np.zeros(3))
    assert kalman.to_polars()["lower"].null_count() == 12
    pytest.importorskip("pyarrow")
    assert kalman.to_arrow()["lower"].null_count == 12


def test_a_run_is_read_through_arrows_interface_and_nothing_stays_behind(run: zb.Track) -> None:
    import gc

    from zonobench import _arrow

    pa, pl = pytest.importorskip("pyarrow"), pytest.importorskip("polars")
    for _ in range(20):
        table, frame = pa.table(run), pl.DataFrame(run)
        assert table.to_pylist() == frame.to_dicts() and table.num_rows == 44
        assert table["upper"].to_pylist()[-1] == run.updated.upper[-1, 1]
    run.__arrow_c_stream__()
    del table, frame
    gc.collect()
    assert not _arrow._held and not _arrow._capsules


def test_a_lake_is_read_as_frames_with_units(program: str, tmp_path: Path) -> None:
    pytest.importorskip("polars")
    pytest.importorskip("pyarrow")
    example = Path(__file__).parent / "pendulum.toml"
    subprocess.run([program, "run", str(example), "--lake", str(tmp_path / "lake"), "--quiet"], check=True)
    lake = zb.lake(tmp_path / "lake")
    assert "scores" in lake.tables and "scores" in dir(lake)
    assert lake.scores.columns[:2] and "experiment" in lake.scores.columns
    frame = lake.table("estimates", frame="pandas")
    assert frame.attrs["units"]["k"] == "1"
    assert lake.units("estimates") == frame.attrs["units"]
    with pytest.raises(AttributeError, match="expected one of the tables"):
        lake.score
    with pytest.raises(zb.Error, match="expected the frame"):
        lake.table("scores", frame="excel")


def test_sets_and_tubes_are_drawn(run: zb.Track, tmp_path: Path) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (left, right) = pyplot.subplots(1, 2)
    z = zb.Zonotope([0, 0, 0], [[1, 0, 1], [0, 1, 1], [1, 1, 0]])
    z.plot(left, dims=(0, 2), color="tab:blue")
    zb.Ellipsoid([0, 0], np.eye(2)).plot(left)
    assert len(left.patches) == 2
    corners = left.patches[0].get_path().vertices
    assert corners[:, 0].max() == pytest.approx(2.0)
    run.plot(0, right)
    assert right.get_ylabel() == "phi in rad"
    figure.savefig(tmp_path / "sets.png")
    pyplot.close(figure)
