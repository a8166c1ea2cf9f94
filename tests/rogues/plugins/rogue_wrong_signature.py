"""A plugin whose hook wants an argument that nobody gives."""

from foreshock.hookspecs import hookimpl


@hookimpl
def foreshock_detectors(config):
    return ()
