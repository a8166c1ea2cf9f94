"""A detector of a kind that the taxonomy does not have."""

from foreshock_stage import detector

from foreshock.hookspecs import hookimpl


@hookimpl
def foreshock_detectors():
    return [detector("rogue_unknown_kind", ["foot-mikro-slip"], lambda now: [])]
