"""Calibration: a, b, c, kappa, window, presence, R and J from labelled events and nominal runs; what P means then."""

from foreshock.calibration.calibrate import Calibrated, calibrate
from foreshock.calibration.compare import Bin, Score, compare, reliability
from foreshock.calibration.correlation import correlation, scaled
from foreshock.calibration.features import Features, features
from foreshock.calibration.fit import Fitted, fit, predict
from foreshock.calibration.landmarks import Landmark, Seen, landmarks
from foreshock.calibration.lift import lifts
from foreshock.calibration.moments import Moments
from foreshock.calibration.profile import Profile

__all__ = [
    "Bin",
    "Calibrated",
    "Features",
    "Fitted",
    "Landmark",
    "Moments",
    "Profile",
    "Score",
    "Seen",
    "calibrate",
    "compare",
    "correlation",
    "features",
    "fit",
    "landmarks",
    "lifts",
    "predict",
    "reliability",
    "scaled",
]
