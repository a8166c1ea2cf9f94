"""A detector whose id is not the name of its entry point."""

from foreshock_stage import SLIP, detector

from foreshock.hookspecs import hookimpl


@hookimpl
def foreshock_detectors():
    return [detector("another", [SLIP], lambda now: [])]
