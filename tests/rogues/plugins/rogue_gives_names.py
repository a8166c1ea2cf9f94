"""A plugin that gives names where specs are expected."""

from foreshock.hookspecs import hookimpl


@hookimpl
def foreshock_detectors():
    return ("gives-names",)
