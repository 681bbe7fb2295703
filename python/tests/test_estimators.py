"""Estimators, the loop, runs: settings, gaps, contradictions, threads, Ctrl-C, memory."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import zonobench as zb
from zonobench import _native

KINDS = {
    "kalman": zb.Kalman,
    "ekf": zb.Ekf,
    "ukf": zb.Ukf,
    "particle": zb.Particle,
    "box-state-est": zb.BoxStateEst,
    "ezgkf": zb.Ezgkf,
    "ezgkf-m": zb.EzgkfM,
    "ezgkp": zb.Ezgkp,
    "zmv": zb.Zmv,
    "zfo": zb.Zfo,
    "czmv": zb.Czmv,
    "czfo": zb.Czfo,
    "zsmf": zb.Zsmf,
    "inzsmf": zb.Inzsmf,
    "rrsr": zb.Rrsr,
    "d-rrsr": zb.DRrsr,
    "d-zb": zb.DZb,
    "d-cz": zb.DCz,
    "comb": zb.Comb,
    "comb+": zb.CombPlus,
    "lift": zb.Lift,
}


def test_every_kind_has_a_class_and_every_setting_a_word_in_its_docstring() -> None:
    kinds = dict(_native._kinds())
    assert set(kinds) == {cls.name for cls in KINDS.values()} and set(kinds) == set(KINDS)
    for kind, keys in kinds.items():
        for key in keys:
            assert key in (KINDS[kind].__doc__ or ""), f"{kind}: {key}"


def test_filters_without_a_set_follow_the_kalman_filter_of_a_linear_system(cart: zb.Problem) -> None:
    truth = zb.simulate(cart, 30, seed=2, u=[0.1], x0=[0.2, -0.1], w="uniform", v="uniform")
    exact = zb.track(zb.Kalman(cart), truth.y, truth.u)
    for kind in (zb.Ekf, zb.Ukf):
        run = zb.track(kind(cart), truth.y, truth.u)
        # Both are the Kalman filter there, by other sums; by themselves they report another phase.
        assert np.allclose(run.updated.center, exact.updated.center, rtol=0, atol=1e-12)
    particles = zb.Online(zb.Particle(cart, particles=200, seed=1))
    belief = particles.step(truth.u[0], truth.y[0])
    assert belief.set is None and belief.hull is None and not zb.Particle(cart).guaranteed


@pytest.mark.parametrize("kind", ["zmv", "zfo", "czmv", "czfo", "rrsr", "d-rrsr", "d-zb", "d-cz", "comb", "comb+", "lift"])
def test_a_guaranteed_filter_never_loses_the_state(kind: str, raimondo: zb.Problem) -> None:
    settings = {"zmv": {"generators": 8}, "zfo": {"generators": 8}}
    settings |= {k: {"generators": 12, "constraints": 3} for k in ("czmv", "czfo")}
    estimator = KINDS[kind](raimondo, **settings.get(kind, {}))
    assert estimator.guaranteed
    truth = zb.simulate(raimondo, 12, seed=5, w="vertices", v="vertices")
    run = zb.track(estimator, truth.y, keep=True)
    assert run.ended is None and len(run) == 13
    assert np.all(run.lower <= truth.x) and np.all(truth.x <= run.upper)
    for x, belief in zip(truth.x, run.beliefs, strict=True):
        assert belief.contains(x) is not False
        assert belief.set is not None and belief.set.contains(x) is not False


def test_the_vehicle_filter_that_is_enclosed_holds_its_state() -> None:
    problem = zb.Problem(
        zb.System.vehicle_se2(0.01),
        zb.Zonotope([np.pi / 2, 0, 0], np.diag([0.1, 0.5, 0.5])),
        w=zb.Box([-0.1] * 3, [0.1] * 3),
        v=zb.Box([-1, -1], [1, 1]),
    )
    estimator = zb.Inzsmf(problem, generators=60, reduction="girard", remainder="enclosed")
    truth = zb.simulate(problem, 40, seed=3, u=[0.4, 8.0], w="vertices", v="vertices")
    run = zb.track(estimator, truth.y, truth.u)
    assert np.all(run.lower <= truth.x) and np.all(truth.x <= run.upper)


def test_steps_one_at_a_time_are_the_steps_of_a_track(cart: zb.Problem, raimondo: zb.Problem) -> None:
    for estimator, u in [
        (zb.Kalman(cart), [1.0]),
        (zb.BoxStateEst(cart), [1.0]),
        (zb.Ezgkf(cart, phi=20, eta=0.5, alpha=0.01), [1.0]),
        (zb.Czmv(raimondo, generators=12, constraints=3), None),
    ]:
        truth = zb.simulate(estimator.problem, 20, seed=1, x0=[0.5, 0.0], u=u, w="uniform", v="uniform")
        y = truth.y.copy()
        y[3] = np.nan
        run = zb.track(estimator, y, truth.u if u else None)
        online = zb.Online(estimator)
        for k in range(21):
            belief = online.step(u, None if k == 3 else y[k])
            assert belief.k == online.k == k
            assert np.array_equal(belief.center, run.updated.center[k])
            if belief.hull is not None:
                assert np.array_equal(belief.hull.lower, run.updated.lower[k])


def test_a_measurement_may_come_in_any_dress(cart: zb.Problem) -> None:
    centers = []
    for y in (0.5, [0.5], (0.5,), np.array([0.5]), np.float64(0.5), np.array([0.5], dtype=np.float32)):
        centers.append(zb.Online(zb.Kalman(cart)).step([0.0], y).center.tolist())
    assert all(c == centers[0] for c in centers)
    blind = [zb.Online(zb.Kalman(cart)).step(0.0, y).center.tolist() for y in (None, np.nan, [None], [np.nan])]
    assert all(c == [0.0, 0.0] for c in blind)


def test_a_contradiction_is_a_result_and_leaves_the_filter_as_it_was(pendulum: zb.Problem) -> None:
    online = zb.Online(zb.Lift(pendulum))
    before = online.step(None, 2.0)
    with pytest.raises(zb.Inconsistent, match="contradicts") as caught:
        online.step(None, 50.0)
    assert caught.value.k == 1 and online.k == 0
    assert online.belief.hull == before.hull
    assert online.step(None, None).k == 1
    truth = zb.simulate(pendulum, 10, seed=1)
    truth.y[4] = 50.0
    run = zb.track(zb.Lift(pendulum), truth.y)
    assert run.ended == 4 and isinstance(run.error, zb.Inconsistent) and run.error.k == 4
    assert run.status.tolist() == ["ok"] * 4 + ["inconsistent"] + [""] * 6
    assert np.isnan(run.updated.center[4:]).all() and not np.isnan(run.predicted.center[4]).any()


def test_predict_update_and_reduce_are_the_loop(raimondo: zb.Problem) -> None:
    estimator = zb.Czmv(raimondo, generators=12, constraints=3)
    online = zb.Online(estimator)
    belief = estimator.update(0, estimator.prior(), None, [0.1, 0.0])
    assert online.step(None, [0.1, 0.0]).hull == belief.hull
    predicted = estimator.predict(1, estimator.reduce_order(0, belief))
    assert online.advance().hull == predicted.hull
    assert online.measure(None, [0.0, None]).hull == estimator.update(1, predicted, None, [0.0, np.nan]).hull


def test_settings_are_those_of_the_crate(raimondo: zb.Problem) -> None:
    czmv = zb.Czmv(raimondo, generators=np.int64(12), constraints=3)
    assert czmv.settings == {"generators": 12, "constraints": 3, "h": "c2"}
    assert czmv.kind == "czmv" and czmv.reported_phase in ("predicted", "updated") and czmv.reads
    assert repr(czmv) == "Czmv(Problem(raimondo), generators=12, constraints=3, h='c2')"
    with pytest.raises(zb.Error, match="czmv: unknown field `generatrs`, expected one of `generators`"):
        zb.Czmv(raimondo, generatrs=12, constraints=3)
    with pytest.raises(zb.Unsupported, match="kalman"):
        zb.Kalman(raimondo)


def test_an_estimator_and_a_problem_come_back_from_a_pickle(raimondo: zb.Problem, cart: zb.Problem) -> None:
    truth = zb.simulate(raimondo, 5, seed=1)
    estimator = zb.Czfo(raimondo, generators=12, constraints=3)
    again = pickle.loads(pickle.dumps(estimator))
    assert type(again) is zb.Czfo and again.settings == estimator.settings
    assert np.array_equal(zb.track(again, truth.y).lower, zb.track(estimator, truth.y).lower)
    other = pickle.loads(pickle.dumps(cart))
    assert other.prior == cart.prior and other.w == cart.w and other.system == cart.system


def test_an_uncertain_vector_gives_back_what_it_was_made_of() -> None:
    box, covariance = zb.Box([-1, 0.1], [1, 0.3]), np.diag([1.0, 2.0])
    both = zb.Uncertain(box, mean=[0.1, 0.2], covariance=covariance)
    assert both.set == box and both.mean is not None and both.covariance is not None
    assert both.mean.tolist() == [0.1, 0.2] and np.array_equal(both.covariance, covariance)
    c = zb.ConstrainedZonotope([0, 0], np.eye(2), [[1, 1]], [0.5])
    assert zb.Uncertain(c).set == c
    assert zb.Uncertain(mean=[0, 0], covariance=covariance).set is None


def test_a_simulation_is_the_same_for_the_same_numbers(raimondo: zb.Problem) -> None:
    a, b = zb.simulate(raimondo, 50, seed=4), zb.simulate(raimondo, 50, seed=4)
    assert np.array_equal(a.x, b.x) and np.array_equal(a.y, b.y)
    assert not np.array_equal(a.x, zb.simulate(raimondo, 50, seed=4, run=1).x)
    assert a.x.shape == (51, 2) and a.w.shape == (50, 2) and a.v.shape == (51, 2)
    again = zb.simulate(raimondo, 50, x0=a.x[0], w=a.w, v=a.v)
    assert np.array_equal(again.x, a.x)
    for k in range(50):
        assert np.array_equal(raimondo.system.f(a.x[k], w=a.w[k], k=k), a.x[k + 1])


def test_a_belief_of_each_kind_answers(cart: zb.Problem) -> None:
    gaussian = zb.Online(zb.Kalman(cart)).step(0.0, 0.5)
    assert gaussian.hull is None and gaussian.set is None and gaussian.radius is None
    assert gaussian.covariance is not None and gaussian.contains([0, 0]) is None
    assert gaussian.ellipsoid(0.01).contains(gaussian.center) is True
    mixed = zb.Online(zb.Ezgkf(cart, phi=20, eta=0.5, alpha=0.01))
    mixed.step(0.0, 0.5)
    belief = mixed.step(0.0, 0.5)
    assert isinstance(belief.set, zb.Zonotope) and belief.covariance is not None and belief.hull is not None
    assert belief.order[0] == belief.set.G.shape[1]
    assert belief.outline().shape[1] == 2


def test_four_threads_on_one_estimator_and_on_four_give_the_same(raimondo: zb.Problem) -> None:
    truth = zb.simulate(raimondo, 30, seed=2)
    expected = zb.track(zb.Czmv(raimondo, generators=12, constraints=3), truth.y)
    shared = zb.Czmv(raimondo, generators=12, constraints=3)

    def run(i: int) -> zb.Track:
        own = shared if i % 2 else zb.Czmv(raimondo, generators=12, constraints=3)
        return zb.track(own, truth.y)

    with ThreadPoolExecutor(4) as pool:
        for result in pool.map(run, range(8)):
            assert np.array_equal(result.lower, expected.lower)


def test_threads_on_one_filter_are_refused_or_right(cart: zb.Problem) -> None:
    online = zb.Online(zb.Czmv(cart, generators=40, constraints=10))
    refused = 0
    steps = 0
    lock = threading.Lock()

    def work() -> None:
        nonlocal refused, steps
        for _ in range(30):
            try:
                online.step([0.0], None)
                with lock:
                    steps += 1
            except RuntimeError as fault:
                assert "its own Online" in str(fault)
                with lock:
                    refused += 1

    threads = [threading.Thread(target=work) for _ in range(4)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert steps + refused == 120
    # The first step is k = 0.
    assert online.k == steps - 1


def test_other_threads_run_during_a_track(cart: zb.Problem) -> None:
    y = np.full((3000, 1), np.nan)
    estimator = zb.Zmv(cart, generators=40)
    ticks = 0
    done = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not done.is_set():
            ticks += 1
            time.sleep(0.0005)

    ticker = threading.Thread(target=tick, daemon=True)
    ticker.start()
    start, rounds, moved = time.perf_counter(), 0, 0
    while time.perf_counter() - start < 0.5 or rounds < 3:
        before = ticks
        zb.track(estimator, y, np.zeros((3000, 1)))
        rounds += 1
        moved += ticks > before + 1
    done.set()
    ticker.join()
    assert moved >= rounds / 2, "the interpreter's lock was held"


@pytest.mark.skipif(os.name == "nt", reason="no SIGINT to a child there")
@pytest.mark.parametrize("call", ["zb.track(e, np.zeros((2_000_000, 1)), np.zeros((2_000_000, 1)))", "zb.simulate(p, 8_000_000, u=[1.0], x0=[0, 0], w='uniform', v='uniform')"])
def test_ctrl_c_ends_a_long_call(call: str) -> None:
    code = f"""
import numpy as np, zonobench as zb
s = zb.System.linear([[1.0, 0.1], [0.0, 0.95]], B=[[0.0], [0.1]], C=[[1.0, 0.0]])
p = zb.Problem(s, zb.Uncertain(zb.Box([-1, -1], [1, 1]), covariance=np.eye(2)),
    w=zb.Uncertain(zb.Box([-1, -1], [1, 1]), covariance=np.eye(2)), v=zb.Uncertain(zb.Box([-1], [1]), covariance=[[1.0]]))
e = zb.Ezgkf(p, phi=20, eta=0.5, alpha=0.01)
print("go", flush=True)
try:
    {call}
    print("finished", flush=True)
except KeyboardInterrupt:
    print("stopped", flush=True)
import os
os._exit(0)
"""
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None and child.stdout.readline() == "go\n"
    time.sleep(0.7)
    child.send_signal(signal.SIGINT)
    out, _ = child.communicate(timeout=60)
    assert out == "stopped\n"


def test_memory_is_flat_over_many_steps(cart: zb.Problem) -> None:
    resource = pytest.importorskip("resource")
    online = zb.Online(zb.Kalman(cart))
    u, y = np.array([1.0]), np.array([0.5])

    def steps(n: int) -> int:
        for _ in range(n):
            online.step(u, y).center
        return int(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)

    first = steps(20_000)
    n = int(os.environ.get("ZONOBENCH_STEPS", "200000"))
    # In KiB on Linux; an array kept a step would be 20 MiB and more.
    assert steps(n) - first < 2048
