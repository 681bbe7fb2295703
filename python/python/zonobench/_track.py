"""Whole runs: `track` over recorded data, `simulate` for data to try an estimator on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._native import Belief, Error, Estimator, Inconsistent, Overflow, Problem, Refused, Singular

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Phase:
    """What was known at every step, before or after its measurement; NaN where it was not.

    center, lower, upper: N + 1 rows of n numbers, the hull between lower and upper; covariance: N + 1 matrices n x n, or None.
    """

    center: Array
    lower: Array
    upper: Array
    covariance: Array | None


class Track:
    """A run of an estimator over k = 0, ..., N.

    predicted, updated: `Phase`s. `center`, `lower`, `upper`, `covariance` are those of the phase that the estimator's paper
    reports. ended: the step at which the run ended early, or None; error: why, or None. status: a word for every step, "ok" or
    why there is nothing ("inconsistent", "refused", "singular", "overflow", "failed", and "" after the end). beliefs: the
    updated `Belief`s, with keep=True.
    """

    def __init__(self, estimator: Estimator, run: Mapping[str, Any]):
        self.estimator = estimator
        self.predicted = Phase(**run["predicted"])
        self.updated = Phase(**run["updated"])
        self.beliefs: list[Belief] = run["beliefs"]
        self.ended: int | None = run.get("ended")
        self.error: Error | None = run.get("error")
        steps = run["steps"]
        self.status: NDArray[np.str_] = np.full(steps, "ok", dtype="<U12")
        if self.ended is not None:
            self.status[self.ended] = _word(self.error)
            self.status[self.ended + 1 :] = ""
            # Rows of steps that were not made.
            for phase in ("predicted", "updated"):
                object.__setattr__(self, phase, _padded(getattr(self, phase), steps))

    @property
    def reported(self) -> Phase:
        """The phase that the estimator's paper reports."""
        return self.predicted if self.estimator.reported_phase == "predicted" else self.updated

    @property
    def center(self) -> Array:
        """Point estimates, (N + 1) x n."""
        return self.reported.center

    @property
    def lower(self) -> Array:
        """Lower bounds, (N + 1) x n; NaN without a set."""
        return self.reported.lower

    @property
    def upper(self) -> Array:
        """Upper bounds, (N + 1) x n; NaN without a set."""
        return self.reported.upper

    @property
    def covariance(self) -> Array | None:
        """Covariances, (N + 1) x n x n, or None."""
        return self.reported.covariance

    def __len__(self) -> int:
        return len(self.status)

    def __repr__(self) -> str:
        end = "" if self.ended is None else f", ended at k = {self.ended}: {self.status[self.ended]}"
        return f"Track({self.estimator.kind}, {len(self)} steps{end})"

    def columns(self) -> dict[str, Any]:
        """The columns of the program's table `estimates`: a row for every step, phase and component."""
        names = [name for name, _ in self.estimator.problem.system.x]
        parts: dict[str, list[Any]] = {key: [] for key in _COLUMNS}
        last = len(self) - 1 if self.ended is None else self.ended
        for k in range(last + 1):
            for word, phase in (("predicted", self.predicted), ("updated", self.updated)):
                is_end = k == self.ended
                if is_end and word == "predicted" and np.isnan(phase.center[k]).any():
                    continue
                status = str(self.status[k]) if word == "updated" else "ok"
                for i, name in enumerate(names):
                    bounds = phase.center[k, i], phase.lower[k, i], phase.upper[k, i]
                    row = ("", 0, k, word, name, *bounds, status)
                    for key, value in zip(_COLUMNS, row, strict=True):
                        parts[key].append(value)
        columns: dict[str, Any] = dict(parts)
        columns["estimator"] = [self.estimator.kind] * len(parts["k"])
        for key in ("run", "k"):
            columns[key] = np.asarray(parts[key], dtype=np.int32)
        for key in ("center", "lower", "upper"):
            columns[key] = np.asarray(parts[key], dtype=np.float64)
        return columns

    def to_pandas(self) -> Any:
        """`columns` as a pandas frame; units of the components in ``attrs["units"]``. Needs pandas."""
        import pandas

        frame = pandas.DataFrame(self.columns())
        frame.attrs["units"] = dict(self.estimator.problem.system.x)
        return frame

    def to_polars(self) -> Any:
        """`columns` as a polars frame, null where there is no number. Needs polars."""
        import polars

        frame = polars.DataFrame(self.columns())
        return frame.with_columns(polars.col("center", "lower", "upper").fill_nan(None))

    def to_arrow(self) -> Any:
        """`columns` as an Arrow table, null where there is no number. Needs pyarrow; other readers of Arrow take the run itself."""
        import pyarrow

        return pyarrow.table(self)

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
        """`columns` through Arrow's PyCapsule interface: `polars.DataFrame(run)`, `pyarrow.table(run)`, DuckDB; no dependency."""
        from . import _arrow

        return _arrow.stream(self.columns())

    def plot(self, component: int = 0, ax: Any = None, **style: Any) -> Any:
        """Draws the tube of one component over k and returns the axes. Needs matplotlib."""
        if ax is None:
            from matplotlib import pyplot

            ax = pyplot.gca()
        k = np.arange(len(self))
        name, unit = self.estimator.problem.system.x[component]
        style = {"alpha": 0.3, "label": type(self.estimator).__name__, **style}
        ax.fill_between(k, self.lower[:, component], self.upper[:, component], **style)
        ax.plot(k, self.center[:, component], linewidth=0.8)
        ax.set_xlabel("k")
        ax.set_ylabel(name if unit == "1" else f"{name} in {unit}")
        return ax


_COLUMNS = ("estimator", "run", "k", "phase", "component", "center", "lower", "upper", "status")


def _word(error: Error | None) -> str:
    for kind, word in (
        (Inconsistent, "inconsistent"),
        (Refused, "refused"),
        (Singular, "singular"),
        (Overflow, "overflow"),
    ):
        if isinstance(error, kind):
            return word
    return "failed"


def _padded(phase: Phase, steps: int) -> Phase:
    def pad(a: Array | None) -> Array | None:
        if a is None:
            return None
        rest = np.full((steps - len(a), *a.shape[1:]), np.nan)
        return np.concatenate([a, rest])

    center, lower, upper = pad(phase.center), pad(phase.lower), pad(phase.upper)
    assert center is not None and lower is not None and upper is not None
    return Phase(center, lower, upper, pad(phase.covariance))


def track(estimator: Estimator, y: Any, u: Any = None, *, keep: bool = False) -> Track:
    """Runs an estimator over recorded data, k = 0, ..., N: the bits are those of the program's `zonobench track`.

    y: N + 1 rows of m numbers, NaN for what was not measured; a vector where m = 1. u: as many rows of p numbers; the last may
    be left out where the measurement does not hold the input. keep: keep the updated beliefs, with their sets.

    A measurement that contradicts the model ends the run and is a result: see `Track.ended` and `Track.error`. Other threads run
    meanwhile, and Ctrl-C works.
    """
    if not isinstance(estimator, Estimator):
        raise TypeError(f"track: expected an estimator, got {type(estimator).__name__}")
    return Track(estimator, _native._track(estimator, _filled(y), _filled(u), keep))


def _filled(given: Any) -> Any:
    """A masked array with NaN where it is masked."""
    if isinstance(given, np.ma.MaskedArray):
        return np.ma.filled(given.astype(float), np.nan)
    return given


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A simulated run: x, y, u, v have rows k = 0, ..., N, w those of k = 0, ..., N - 1.

    rounding: x +- rounding encloses the exact trajectory of the noise that was drawn; infinite where no bound is known.
    """

    x: Array
    y: Array
    u: Array
    w: Array
    v: Array
    rounding: Array


def simulate(
    problem: Problem,
    steps: int,
    *,
    seed: int = 0,
    run: int = 0,
    x0: Any = None,
    u: Any = None,
    w: Any = None,
    v: Any = None,
) -> Trajectory:
    """A true trajectory of the problem's system and its measurements, k = 0, ..., N = steps.

    x0: the first state; unless given, uniform in the prior's set. u: p numbers for all steps, or a row of them for every step.
    w, v: "uniform", "gaussian", "mixed", "vertices", "zero", or the noise of every step; unless given, uniform in what the
    problem assumes. seed, run: the same numbers give the same bits.

    Raises `Diverged` where the state overflows. Ctrl-C works.
    """
    if not isinstance(problem, Problem):
        raise TypeError(f"simulate: expected a problem, got {type(problem).__name__}")
    return Trajectory(**_native._simulate(problem, steps, seed, run, x0, u, w, v))
