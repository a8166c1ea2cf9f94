"""A plugin whose hook lacks @hookimpl."""


def foreshock_detectors():
    return ()
