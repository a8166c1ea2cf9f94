"""A detector whose heavy package is not installed."""

import msgspec
from foreshock_stage import SLIP, detector

from foreshock.hookspecs import hookimpl


def build(config):
    import a_package_that_nobody_has  # noqa: F401 # on purpose


@hookimpl
def foreshock_detectors():
    return [
        msgspec.structs.replace(detector("rogue_missing_extra", [SLIP], lambda now: []), build=build, extra="balance")
    ]
