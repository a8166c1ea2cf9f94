"""Calibration: a, b, c, kappa, R and J from labelled events and nominal runs, and what P means afterwards."""

from foreshock.calibration.compare import Bin, Score, compare, reliability
from foreshock.calibration.correlation import correlation
from foreshock.calibration.features import Features, features
from foreshock.calibration.fit import Fitted, fit, predict
from foreshock.calibration.landmarks import Landmark, Seen, landmarks
from foreshock.calibration.lift import lifts

__all__ = [
    "Bin",
    "Features",
    "Fitted",
    "Landmark",
    "Score",
    "Seen",
    "compare",
    "correlation",
    "features",
    "fit",
    "landmarks",
    "lifts",
    "predict",
    "reliability",
]
