"""A plugin whose detector is not called like its entry point."""

from tests.rogues.plugins.rogue_detectors import Upright, spec_of

from foreshock.hookspecs import hookimpl


@hookimpl
def foreshock_detectors():
    return (spec_of(Upright),)
