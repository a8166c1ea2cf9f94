"""A plugin that declares a misspelt kind, a channel with the robot's name, and bare settings."""

import msgspec

from foreshock.detector import DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import Scalar


class Settings(msgspec.Struct):
    limit: float


def _build(settings):
    raise OSError("no such device")


@hookimpl
def foreshock_detectors():
    inputs = (Input("value", "Talos/Knee", Scalar, max_age_s=0.0),)
    return (DetectorSpec("bad-kind", ("torque-saturtion",), inputs, _build, Settings, deadline_s=0.0),)
