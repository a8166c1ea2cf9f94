"""A plugin with a misspelt hook that lacks its mark."""


def foreshock_presursors():
    return ()
