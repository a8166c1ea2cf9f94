"""A plugin without fault, to stand beside the others."""

from tests.rogues.plugins.rogue_detectors import Upright, spec_of

from foreshock.hookspecs import hookimpl


@hookimpl
def foreshock_detectors():
    return (spec_of(Upright),)
