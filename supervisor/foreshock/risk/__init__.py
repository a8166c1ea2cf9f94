"""From precursors to accident probability: Eq. 1 on plain counts, and its extension to correlated precursors."""

from foreshock.risk._capacity import Capacity, choquet
from foreshock.risk._cascade import Element, cascade_lift
from foreshock.risk._correlated import CorrelatedRisk
from foreshock.risk._estimator import RiskModel
from foreshock.risk._independent import IndependentRisk
from foreshock.risk._le import LogisticExponential
from foreshock.risk._parameters import Link, Pair, Provenance, RiskParameters, load_parameters, save_parameters
from foreshock.risk._settings import RiskSettings

__all__ = [
    "Capacity",
    "CorrelatedRisk",
    "Element",
    "IndependentRisk",
    "Link",
    "LogisticExponential",
    "Pair",
    "Provenance",
    "RiskModel",
    "RiskParameters",
    "RiskSettings",
    "cascade_lift",
    "choquet",
    "load_parameters",
    "save_parameters",
]
