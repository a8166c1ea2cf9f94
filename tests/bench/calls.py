"""What the detectors ask of their libraries in one tick, and what those bare calls cost by themselves."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import fcl
import pinocchio as pin
from filterpy.kalman import KalmanFilter

from tests.bench.rows import median_us

__all__ = ["Calls", "recorded"]

WATCHED: tuple[tuple[Any, str], ...] = (
    *(
        (pin, name)
        for name in (
            "forwardKinematics",
            "computeCentroidalMomentum",
            "computeCentroidalMomentumTimeVariation",
            "centerOfMass",
            "updateFramePlacement",
            "updateFramePlacements",
            "getFrameVelocity",
            "updateGeometryPlacements",
            "computeDistances",
            "rnea",
        )
    ),
    *((fcl, name) for name in ("distance", "CollisionObject", "Capsule", "Transform", "DistanceResult")),
    *((KalmanFilter, name) for name in ("predict", "update")),
)


class Calls:
    """How often each watched function was called, and its last arguments."""

    def __init__(self) -> None:
        self.counts: dict[str, int] = {}
        self.last: dict[str, tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]] = {}

    def cost_us(self, ticks: int) -> dict[str, float]:
        """Per tick: calls of each function times the median cost of the bare call."""
        return {
            name: self.counts[name] / ticks * median_us(lambda f=f, a=a, k=k: f(*a, **k), 500)
            for name, (f, a, k) in self.last.items()
        }


@contextmanager
def recorded() -> Iterator[Calls]:
    """Counts the watched calls that are made inside."""
    calls, originals = Calls(), []
    for owner, name in WATCHED:
        original = getattr(owner, name)
        originals.append((owner, name, original))

        def wrapper(*args: Any, _f: Any = original, _n: str = f"{owner.__name__}.{name}", **kwargs: Any) -> Any:
            calls.counts[_n] = calls.counts.get(_n, 0) + 1
            calls.last[_n] = (_f, args, kwargs)
            return _f(*args, **kwargs)

        setattr(owner, name, wrapper)
    try:
        yield calls
    finally:
        for owner, name, original in originals:
            setattr(owner, name, original)
