"""A plugin whose import fails."""

raise RuntimeError("no such device")
