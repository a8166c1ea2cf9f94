"""A hook that raises."""

from foreshock.hookspecs import hookimpl


@hookimpl
def foreshock_detectors():
    raise RuntimeError("in the hook")
