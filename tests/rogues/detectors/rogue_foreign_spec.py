"""A hook that gives something else than specs."""

from foreshock.hookspecs import hookimpl


@hookimpl
def foreshock_detectors():
    return ["rogue_foreign_spec"]
