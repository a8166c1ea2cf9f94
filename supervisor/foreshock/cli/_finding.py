"""One check of ``foreshock doctor``."""

from __future__ import annotations

import msgspec

__all__ = ["Finding"]


class Finding(msgspec.Struct, frozen=True):
    """One check: what, whether it is fine (None: it does not matter here), and what was found."""

    what: str
    fine: bool | None
    found: str
