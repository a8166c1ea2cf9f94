"""The versioned parameter file of the correlated model: what was fitted, to what, and how sure it is."""

from __future__ import annotations

import math
from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from foreshock._strict import convert, read_toml, within
from foreshock.errors import ConfigError, nearest
from foreshock.risk._capacity import Matrix
from foreshock.taxonomy import Taxonomy

__all__ = ["Link", "Pair", "Provenance", "RiskParameters", "load_parameters", "save_parameters"]

BUILT_IN = ("table-3",)
"""Parameter files that are shipped, by name."""


class Pair(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The correlation r of the statistics of two kinds in nominal operation, with its interval; all 0..1."""

    kinds: tuple[str, str]
    r: float
    low: float
    high: float


class Link(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The lift J >= 0 of "some onset of first before some onset of then" in accident data, with its interval."""

    first: str
    then: str
    lift: float
    low: float
    high: float


class Provenance(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where the numbers come from.

    Attributes:
        source: for people: the paper's table, the event tables or campaigns.
        created: date, ISO 8601.
        command: what made the file.
        data: names and SHA-256 of the inputs.
        synthetic: whether any of the data is synthetic.
        note: anything that a user must know.
    """

    source: str
    created: str = ""
    command: str = ""
    data: tuple[str, ...] = ()
    synthetic: bool = False
    note: str = ""


class RiskParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Everything that the correlated Logistic-Exponential model needs.

    Attributes:
        format: of the file, with its version.
        name: of this set.
        provenance: where it comes from.
        a: gain of Eq. 1.
        b: half-way number of kinds of Eq. 1.
        c: saturation of recurrence of Eq. 1.
        kappa: weight of the cascade lift, >= 0.
        presence: strength of a precursor of severity 0, in 0..1; one of severity 1 has strength 1.
        rho: scale of R against what nominal statistics alone gave, in 0..1; every r holds it already.
        window_s: the window that the numbers hold for.
        horizon_s: P is the probability of the accident within this time; 0 where nothing was calibrated.
        intervals: 95% intervals of the fitted scalars, by name.
        correlation: pairs that correlate; all others do not.
        cascade: ordered pairs that lift.
    """

    name: str
    provenance: Provenance
    format: Literal["foreshock-risk-parameters/1"] = "foreshock-risk-parameters/1"
    a: float = 1.6
    b: float = 2.0
    c: float = 1.2
    kappa: float = 1.0
    presence: float = 1.0
    rho: float = 1.0
    window_s: float = 1.5
    horizon_s: float = 0.0
    intervals: dict[str, tuple[float, float]] = {}
    correlation: tuple[Pair, ...] = ()
    cascade: tuple[Link, ...] = ()

    def __post_init__(self) -> None:
        within("a", self.a, 0.0, above=True)
        within("b", self.b, -math.inf)
        within("c", self.c, 0.0, above=True)
        within("kappa", self.kappa, 0.0)
        within("presence", self.presence, 0.0, 1.0)
        within("rho", self.rho, 0.0, 1.0)
        within("window_s", self.window_s, 0.0, above=True)
        within("horizon_s", self.horizon_s, 0.0)
        for k, pair in enumerate(self.correlation):
            place = f"correlation[{k}]"
            for name, value in (("r", pair.r), ("low", pair.low), ("high", pair.high)):
                within(f"{place}.{name}", value, 0.0, 1.0)
            if not pair.low <= pair.r <= pair.high:
                raise ConfigError(place, f"low {pair.low!r} <= r {pair.r!r} <= high {pair.high!r} must hold")
            if pair.kinds[0] == pair.kinds[1]:
                raise ConfigError(place, f"{pair.kinds[0]!r} with itself")
        for k, link in enumerate(self.cascade):
            place = f"cascade[{k}]"
            for name, value in (("lift", link.lift), ("low", link.low), ("high", link.high)):
                within(f"{place}.{name}", value, 0.0)
            if not link.low <= link.lift <= link.high:
                raise ConfigError(place, f"low {link.low!r} <= lift {link.lift!r} <= high {link.high!r} must hold")
            if link.first == link.then:
                raise ConfigError(place, f"{link.first!r} before itself")
        _refuse_twice("correlation", [frozenset(p.kinds) for p in self.correlation])
        _refuse_twice("cascade", [(link.first, link.then) for link in self.cascade])

    def matrix(self, kinds: list[str]) -> Matrix:
        """R of these kinds, n x n."""
        at = {kind: k for k, kind in enumerate(kinds)}
        r = np.eye(len(kinds))
        for pair in self.correlation:
            i, j = (at.get(kind, -1) for kind in pair.kinds)
            if i >= 0 and j >= 0:
                r[i, j] = r[j, i] = pair.r
        return r

    def check(self, taxonomy: Taxonomy, place: str) -> RiskParameters:
        """These parameters, with every kind resolved to its id.

        Raises:
            ConfigError: an unknown kind, with the nearest one; or an R that is no correlation matrix.
        """
        pairs = tuple(
            msgspec.structs.replace(
                p,
                kinds=(
                    taxonomy.kind(p.kinds[0], f"{place}: correlation[{k}].kinds").id,
                    taxonomy.kind(p.kinds[1], f"{place}: correlation[{k}].kinds").id,
                ),
            )
            for k, p in enumerate(self.correlation)
        )
        links = tuple(
            msgspec.structs.replace(
                link,
                first=taxonomy.kind(link.first, f"{place}: cascade[{k}].first").id,
                then=taxonomy.kind(link.then, f"{place}: cascade[{k}].then").id,
            )
            for k, link in enumerate(self.cascade)
        )
        try:
            checked = msgspec.structs.replace(self, correlation=pairs, cascade=links)
        except ConfigError as e:  # two names of one kind
            raise ConfigError(f"{place}: {e.place}", e.problem, e.hint) from None
        kinds = sorted({kind for p in pairs for kind in p.kinds})
        least = float(np.linalg.eigvalsh(checked.matrix(kinds))[0]) if pairs else 1.0
        if least < -1e-6:
            problem = f"not a correlation matrix: its smallest eigenvalue is {least:.3g}"
            raise ConfigError(f"{place}: correlation", problem, "; shrink the r towards 0")
        return checked


def _refuse_twice(place: str, keys: Iterable[object]) -> None:
    seen: set[object] = set()
    for k, key in enumerate(keys):
        if key in seen:
            names = " and ".join(sorted(key)) if isinstance(key, frozenset) else " before ".join(map(str, key))  # type: ignore[call-overload]  # a key is a set or a pair of kinds
            raise ConfigError(f"{place}[{k}]", f"{names} is listed twice")
        seen.add(key)


def load_parameters(name: str, base: Path, taxonomy: Taxonomy) -> RiskParameters:
    """A parameter file, or one that is shipped (``table-3``).

    Args:
        name: of a file (``.toml``), relative to base, or of a shipped set.
        base: folder that a relative path starts from.
        taxonomy: that its kinds belong to.

    Raises:
        ConfigError: names place, value and nearest name of the first thing that is wrong.
    """
    if name.endswith(".toml"):
        path = base / name
        data = read_toml(path)
        place = str(path)
    elif name in BUILT_IN:
        place = f"{name}.toml"
        data = read_toml(Path(str(files("foreshock").joinpath(f"data/parameters/{place}"))))
    else:
        raise ConfigError(
            "risk.parameters", f"no parameter set {name!r}", nearest(name, BUILT_IN) + "; or a .toml file"
        )
    return convert(data, RiskParameters, place).check(taxonomy, place)


def save_parameters(path: Path, parameters: RiskParameters) -> None:
    """Write a parameter file that load_parameters reads back to the same values."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(msgspec.toml.encode(parameters))
