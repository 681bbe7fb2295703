from typing import Any, ClassVar, Literal, TypedDict

from typing_extensions import NotRequired, Self, Unpack

from ._native import Estimator, Problem

_Scale = Literal["none", "prior"]

class EzgkfSettings(TypedDict):
    phi: int
    eta: float
    alpha: float
    gain: NotRequired[Literal["optimal", "unsquared"]]
    overbars: NotRequired[bool]
    merge_parallel: NotRequired[bool]
    scale: NotRequired[_Scale]

class EzgkpSettings(EzgkfSettings):
    form: NotRequired[Literal["ak", "direct"]]

class KalmanSettings(TypedDict): ...

class EkfSettings(TypedDict):
    wrap: NotRequired[bool]

class UkfSettings(TypedDict):
    alpha: NotRequired[float]
    beta: NotRequired[float]
    kappa: NotRequired[float]
    wrap: NotRequired[bool]

class ParticleSettings(TypedDict):
    particles: NotRequired[int]
    resample_below: NotRequired[float]
    seed: NotRequired[int]
    wrap: NotRequired[bool]

class MeasurementSettings(TypedDict):
    passes: NotRequired[Literal[1, 2]]

class BoxStateEstSettings(TypedDict):
    products: NotRequired[Literal["stacked", "printed"]]
    scale: NotRequired[_Scale]

class ZonotopeFilterSettings(TypedDict):
    generators: int
    scale: NotRequired[_Scale]
    measurement: NotRequired[MeasurementSettings]

class CzmvSettings(TypedDict):
    generators: int
    constraints: int
    h: NotRequired[Literal["c1", "c2", "c3", "c4", "xb", "c4xb"]]
    scale: NotRequired[_Scale]
    measurement: NotRequired[MeasurementSettings]

class CzfoSettings(CzmvSettings):
    expansion: NotRequired[Literal["full", "lean"]]
    remainder: NotRequired[Literal["symmetric", "printed"]]

class VehicleFilterSettings(TypedDict):
    generators: int
    gain: NotRequired[Literal["f-radius"] | dict[str, Any]]
    reduction: NotRequired[Literal["outer", "girard", "paper-tables"]]
    transition: NotRequired[Literal["exact", "first-order"]]
    transient: NotRequired[Literal["printed", "lag", "initial-update"]]
    remainder: NotRequired[Literal["dropped", "enclosed"]]
    side: NotRequired[Literal["left", "right"]]
    scale: NotRequired[_Scale]

class PolytopeFilterSettings(TypedDict):
    vectors: NotRequired[Literal["paper", "signed"]]
    choose: NotRequired[Literal["argmin", "all"]]
    jacobian: NotRequired[Literal["natural", "decomposition"]]
    start: NotRequired[Literal["hull", "set"]]
    facets: NotRequired[int]

class LiftSettings(PolytopeFilterSettings):
    carry: NotRequired[Literal["facets", "hull"]]

class Kind(Estimator):
    name: ClassVar[str]
    @property
    def settings(self) -> dict[str, Any]: ...

class Kalman(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[KalmanSettings]) -> Self: ...

class Ekf(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[EkfSettings]) -> Self: ...

class Ukf(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[UkfSettings]) -> Self: ...

class Particle(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[ParticleSettings]) -> Self: ...

class BoxStateEst(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[BoxStateEstSettings]) -> Self: ...

class Ezgkf(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[EzgkfSettings]) -> Self: ...

class EzgkfM(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[EzgkfSettings]) -> Self: ...

class Ezgkp(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[EzgkpSettings]) -> Self: ...

class Zmv(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[ZonotopeFilterSettings]) -> Self: ...

class Zfo(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[ZonotopeFilterSettings]) -> Self: ...

class Czmv(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[CzmvSettings]) -> Self: ...

class Czfo(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[CzfoSettings]) -> Self: ...

class Zsmf(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[VehicleFilterSettings]) -> Self: ...

class Inzsmf(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[VehicleFilterSettings]) -> Self: ...

class Rrsr(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[PolytopeFilterSettings]) -> Self: ...

class DRrsr(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[PolytopeFilterSettings]) -> Self: ...

class DZb(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[PolytopeFilterSettings]) -> Self: ...

class DCz(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[PolytopeFilterSettings]) -> Self: ...

class Comb(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[PolytopeFilterSettings]) -> Self: ...

class CombPlus(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[PolytopeFilterSettings]) -> Self: ...

class Lift(Kind):
    def __new__(cls, problem: Problem, **settings: Unpack[LiftSettings]) -> Self: ...
