"""A plugin that imports what is not there."""

import foreshock.detektor  # noqa: F401 # type: ignore[import-not-found]
