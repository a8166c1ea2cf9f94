"""The labelled moments of a set of events through any window: times and labels stay, what is in the window changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from foreshock.calibration.features import Features, Values, effective, lifted
from foreshock.calibration.landmarks import Landmark, landmarks
from foreshock.events.schema import Event

__all__ = ["Moments"]

Array = NDArray[np.float64]


class Moments:
    """Labelled moments, and their features at any window, scale of R and presence; each is worked out once.

    Args:
        events: each coded once.
        horizon_s: H.
        mode: code of the accident mode that is predicted; ``""`` for any.
        correlation: r of pairs of kinds at rho = 1.
        at: see landmarks.

    Attributes:
        groups: names of the fold groups, sorted.
        group: number of the group of each moment.
        y: label of each moment, 0 or 1.

    Raises:
        BadInputError: see landmarks.
    """

    def __init__(
        self,
        events: Sequence[Event],
        horizon_s: float,
        mode: str = "",
        correlation: Mapping[tuple[str, str], float] | None = None,
        at: Literal["grid", "last-onset"] = "grid",
    ) -> None:
        self._events, self._horizon_s, self._mode, self._at = events, horizon_s, mode, at
        self._correlation = dict(correlation or {})
        self._through: dict[float, list[Landmark]] = {}
        self._effective: dict[tuple[float, float, float], tuple[Array, Array]] = {}
        some = self.through(1.5)
        self.groups = sorted({x.group for x in some})
        number = {g: k for k, g in enumerate(self.groups)}
        self.group = np.array([number[x.group] for x in some], np.int64)
        self.y = np.array([x.accident for x in some], float)

    @property
    def correlated(self) -> bool:
        """Whether any pair of kinds correlates."""
        return any(r > 0.0 for r in self._correlation.values())

    def graded(self, window_s: float) -> bool:
        """Whether severities differ between what is seen through a window, so that they can tell anything."""
        return len({s.severity for x in self.through(window_s) for s in x.seen}) > 1

    def through(self, window_s: float) -> Sequence[Landmark]:
        """The moments as seen through a window."""
        if window_s not in self._through:
            self._through[window_s] = landmarks(self._events, window_s, self._horizon_s, self._mode, self._at)
        return self._through[window_s]

    def features(self, window_s: float, rho: float, presence: float, lifts: Values) -> Features:
        """Features through a window, with R = rho R0 off its diagonal.

        Args:
            window_s: of the evidence.
            rho: scale of R.
            presence: strength of a precursor of severity 0.
            lifts: J by (first, then).
        """
        seen = self.through(window_s)
        r = {pair: rho * value for pair, value in self._correlation.items()}
        key = (window_s, rho, presence)
        if key not in self._effective:
            self._effective[key] = effective(seen, r, presence)
        return Features(*self._effective[key], lifted(seen, r, lifts, presence), self.y, self.group)
