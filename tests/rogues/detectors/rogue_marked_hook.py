"""A hook that is marked but whose name nobody specified."""

from foreshock.hookspecs import hookimpl


@hookimpl
def frshock_detectors():
    return ()
