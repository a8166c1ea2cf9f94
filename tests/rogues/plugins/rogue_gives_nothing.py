"""A plugin that forgot to return."""

from foreshock.hookspecs import hookimpl


@hookimpl
def foreshock_detectors():
    pass
