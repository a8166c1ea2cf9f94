"""A hook without its last letter, and without the marker: pluggy alone would never look at it."""


def foreshock_detector():
    return ()
