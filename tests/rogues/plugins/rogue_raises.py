"""A plugin that raises when it is asked."""

from foreshock.hookspecs import hookimpl


@hookimpl
def foreshock_detectors():
    return (1 / 0,)
