"""A detector that cannot be built."""

import msgspec
from foreshock_stage import SLIP, detector

from foreshock.hookspecs import hookimpl


@hookimpl
def foreshock_detectors():
    spec = detector("rogue_build_raises", [SLIP], lambda now: [])
    return [msgspec.structs.replace(spec, build=lambda _: 1 / 0)]
