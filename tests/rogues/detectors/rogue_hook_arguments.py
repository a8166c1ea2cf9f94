"""A hook that wants an argument that the specification does not have."""

from foreshock.hookspecs import hookimpl


@hookimpl
def foreshock_detectors(robot):
    return ()
