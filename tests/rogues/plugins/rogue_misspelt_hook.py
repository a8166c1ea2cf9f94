"""A plugin with a misspelt hook, marked as one."""

from foreshock.hookspecs import hookimpl


@hookimpl
def foreshock_detector():
    return ()
