"""Foreshock: a plugin-based safety supervisor for humanoid robots."""

from foreshock.config import Config, load_config
from foreshock.detector import Detector, DetectorSpec, Input, Inputs
from foreshock.hookspecs import hookimpl
from foreshock.records import Decision, Indication, Intervention, ProtectionLevel, Sample
from foreshock.risk import LogisticExponential
from foreshock.supervisor import Supervisor

__all__ = [
    "Config",
    "Decision",
    "Detector",
    "DetectorSpec",
    "Indication",
    "Input",
    "Inputs",
    "Intervention",
    "LogisticExponential",
    "ProtectionLevel",
    "Sample",
    "Supervisor",
    "hookimpl",
    "load_config",
]
