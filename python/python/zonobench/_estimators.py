"""The estimators, one class a kind. What a setting means, and what it may be, is checked where the estimator is made.

Each takes a `Problem` and its settings by keyword, and raises `Error` at a setting that is unknown, missing or out of range, and
at a problem that lacks what the kind needs (`Unsupported` where it cannot have it).
"""

from __future__ import annotations

import json
from typing import Any, ClassVar

from . import _json
from ._native import Estimator, Problem


class Kind(Estimator):
    """An estimator of one kind."""

    name: ClassVar[str]

    def __new__(cls, problem: Problem, **settings: Any) -> Any:
        if not isinstance(problem, Problem):
            raise TypeError(f"{cls.__name__}: expected a Problem, got {type(problem).__name__}")
        return Estimator.__new__(cls, problem, cls.name, _json.dumps(cls.name, settings))

    @property
    def settings(self) -> dict[str, Any]:
        """The settings, defaults written out."""
        settings: dict[str, Any] = json.loads(self.settings_json())
        del settings["kind"]
        return settings

    def __repr__(self) -> str:
        settings = ", ".join(f"{key}={value!r}" for key, value in self.settings.items() if value is not None)
        return f"{type(self).__name__}({self.problem!r}{', ' if settings else ''}{settings})"

    def __reduce__(self) -> tuple[Any, ...]:
        given = {key: value for key, value in self.settings.items() if value is not None}
        return _again, (type(self), self.problem, given)


def _again(cls: type[Kind], problem: Problem, settings: dict[str, Any]) -> Kind:
    made: Kind = cls(problem, **settings)
    return made


class Kalman(Kind):
    """Kalman filter of a linear system with Gaussian noise.

    No settings. Promises probabilities; `hull` and `set` are None. Needs mean and covariance of prior, w and v.
    """

    name = "kalman"


class Ekf(Kind):
    """Extended Kalman filter: linearised about its estimate by the system's own derivatives. Not guaranteed.

    wrap: True takes differences of measurements in rad in (-pi, pi]. Of a noise that is a set alone, mean and covariance are
    those of the uniform distribution over its generators. `set` is None.
    """

    name = "ekf"


class Ukf(Kind):
    """Unscented Kalman filter, Julier's scaled form. Not guaranteed.

    alpha: how far the points are spread, 1 unless given. beta: what is known of the fourth moment, 2 unless given.
    kappa: 0 unless given. wrap: as in `Ekf`.
    """

    name = "ukf"


class Particle(Kind):
    """Bootstrap particle filter with systematic resampling. Not guaranteed.

    particles: how many, 1000 unless given. resample_below: the share of them, 0.5 unless given, below which their effective
    number makes the filter resample. seed: of its own random numbers. wrap: as in `Ekf`.
    """

    name = "particle"


class BoxStateEst(Kind):
    """Box-State-Est of [Meslem], a box observer of a linear system. Guaranteed with stacked products.

    products: "stacked" (the default) or "printed". scale: "none" or "prior".
    """

    name = "box-state-est"


class Ezgkf(Kind):
    """EZGKF of [dePaula], a zonotopic and Gaussian filter.

    phi: the number of generators kept, at least n. eta: the weight of the Gaussian part in the gain, in [0, 1]. alpha: the
    confidence box is made for the probability 1 - alpha. gain: "optimal" or "unsquared". overbars, merge_parallel: True or
    False. scale: "none" or "prior".
    """

    name = "ezgkf"


class EzgkfM(Kind):
    """EZGKF-M of [dePaula].

    phi: the number of generators kept, at least n. eta: the weight of the Gaussian part in the gain, in [0, 1]. alpha: the
    confidence box is made for the probability 1 - alpha. gain: "optimal" or "unsquared". overbars, merge_parallel: True or
    False. scale: "none" or "prior".
    """

    name = "ezgkf-m"


class Ezgkp(Kind):
    """EZGKP of [dePaula], the predictor.

    phi: the number of generators kept, at least n. eta: the weight of the Gaussian part in the gain, in [0, 1]. alpha: the
    confidence box is made for the probability 1 - alpha. gain: "optimal" or "unsquared". overbars, merge_parallel: True or
    False. scale: "none" or "prior".
    form: "ak" or "direct".
    """

    name = "ezgkp"


class Zmv(Kind):
    """ZMV of [Rego2020]: zonotopes, mean value extension. Guaranteed.

    generators: the number kept, at least n. scale: "none" or "prior". measurement: {"passes": 2} reads a measurement that is
    not linear twice.
    """

    name = "zmv"


class Zfo(Kind):
    """ZFO of [Rego2020]: zonotopes, first-order Taylor extension. Guaranteed.

    generators: the number kept, at least n. scale: "none" or "prior". measurement: {"passes": 2} reads a measurement that is
    not linear twice.
    """

    name = "zfo"


class Czmv(Kind):
    """CZMV of [Rego2020]: constrained zonotopes, mean value extension. Guaranteed.

    generators: the number kept, at least n + constraints. constraints: the number kept.
    h: the point that f is linearised about, "c1", "c2" (the default), "c3", "c4", "xb" or "c4xb".
    scale: "none" or "prior", in whose units components are compared.
    measurement: {"passes": 2} reads a measurement that is not linear twice.
    """

    name = "czmv"


class Czfo(Kind):
    """CZFO of [Rego2020]: constrained zonotopes, first-order Taylor extension. Guaranteed with the symmetric remainder.

    generators: the number kept, at least n + constraints. constraints: the number kept.
    h: the point of expansion, "c4" unless given. expansion: "full" or "lean". remainder: "symmetric" or "printed".
    scale: "none" or "prior", in whose units components are compared.
    measurement: {"passes": 2} reads a measurement that is not linear twice.
    """

    name = "czfo"


class Zsmf(Kind):
    """ZSMF of [Li] of a vehicle on SE(2). Not guaranteed.

    generators: the number kept. gain: "f-radius" or {"longitudinal": p1, "lateral": [p2, p3]}. reduction: "outer", "girard" or
    "paper-tables". transition: "exact" or "first-order". transient: "printed", "lag" or "initial-update". remainder: "dropped" or
    "enclosed". side: "left" or "right". scale: "none" or "prior".
    """

    name = "zsmf"


class Inzsmf(Kind):
    """InZSMF of [Li] of a vehicle on SE(2). Guaranteed with remainder="enclosed".

    generators: the number kept. gain: "f-radius" or {"longitudinal": p1, "lateral": [p2, p3]}. reduction: "outer", "girard" or
    "paper-tables". transition: "exact" or "first-order". transient: "printed", "lag" or "initial-update". remainder: "dropped" or
    "enclosed". side: "left" or "right". scale: "none" or "prior".
    """

    name = "inzsmf"


class Rrsr(Kind):
    """RRSR of [Khajenejad]. Guaranteed.

    vectors: "paper" or "signed". choose: "argmin" or "all". jacobian: "natural" or "decomposition". start: "hull" or "set".
    facets: how many a step starts from.
    """

    name = "rrsr"


class DRrsr(Kind):
    """D-RRSR of [Khajenejad]. Guaranteed.

    vectors: "paper" or "signed". choose: "argmin" or "all". jacobian: "natural" or "decomposition". start: "hull" or "set".
    facets: how many a step starts from.
    """

    name = "d-rrsr"


class DZb(Kind):
    """D-ZB of [Khajenejad]. Guaranteed.

    vectors: "paper" or "signed". choose: "argmin" or "all". jacobian: "natural" or "decomposition". start: "hull" or "set".
    facets: how many a step starts from.
    """

    name = "d-zb"


class DCz(Kind):
    """D-CZ of [Khajenejad]. Guaranteed.

    vectors: "paper" or "signed". choose: "argmin" or "all". jacobian: "natural" or "decomposition". start: "hull" or "set".
    facets: how many a step starts from.
    """

    name = "d-cz"


class Comb(Kind):
    """COMB of [Khajenejad]: D-ZB and D-CZ intersected. Guaranteed.

    vectors: "paper" or "signed". choose: "argmin" or "all". jacobian: "natural" or "decomposition". start: "hull" or "set".
    facets: how many a step starts from.
    """

    name = "comb"


class CombPlus(Kind):
    """COMB with signed vectors and decomposition functions. Guaranteed.

    vectors: "paper" or "signed". choose: "argmin" or "all". jacobian: "natural" or "decomposition". start: "hull" or "set".
    facets: how many a step starts from.
    """

    name = "comb+"


class Lift(Kind):
    """A filter that imposes the relations of all the others at once. Guaranteed.

    vectors: "paper" or "signed". choose: "argmin" or "all". jacobian: "natural" or "decomposition". start: "hull" or "set".
    facets: how many a step starts from.
    carry: "facets" (the default up to three dimensions), "hull".
    """

    name = "lift"
