"""The whole fit to all moments: window, scale of R and presence by profile likelihood, then a, b, c and kappa there."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from foreshock.calibration.features import Values
from foreshock.calibration.fit import Fitted, fit
from foreshock.calibration.moments import Moments
from foreshock.calibration.profile import WINDOWS_S, Profile, Surface, axes, best, profiles, refined

__all__ = ["Calibrated", "calibrate"]


class Calibrated(msgspec.Struct, frozen=True):
    """What was fitted.

    Attributes:
        window_s: of the evidence.
        rho: scale of R, 1 where no pair correlates.
        presence: strength of a precursor of severity 0, 1 where severities do not differ.
        profiles: of those of the three that were fitted, by name.
        fitted: a, b, c and kappa at these values.
    """

    window_s: float
    rho: float
    presence: float
    profiles: dict[str, Profile]
    fitted: Fitted


def calibrate(moments: Moments, lifts: Values, windows: Sequence[float] = ()) -> Calibrated:
    """Fit everything to all moments.

    Args:
        moments: labelled.
        lifts: J by (first, then).
        windows: in s, to choose from, or one that is given; by default 0.5 to 3 s with finer steps beside the best.

    Raises:
        BadInputError: no moment with evidence, or all of them have one outcome.
    """
    surface = Surface(moments, lifts)
    coarse = axes(moments, windows or WINDOWS_S)
    fine, top = refined(surface, coarse, best(surface, coarse), ("window_s",) if windows else ())
    found = profiles(surface, fine, coarse, top)
    return Calibrated(*top, found, fit(moments.features(*top, lifts)))
