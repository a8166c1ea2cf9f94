"""What each arm looks like in the figures of a report."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from foreshock.errors import MissingExtraError

__all__ = ["Look", "looks_of"]

SHAPES = (
    ("M-1 0a1 1 0 1 0 2 0a1 1 0 1 0-2 0z", ""),
    ("M-.9-.9H.9V.9H-.9z", "7 3"),
    ("M0-1.15L1.1.8H-1.1z", "2 2"),
    ("M0-1.3L1.3 0 0 1.3-1.3 0z", "5 2 1 2"),
)
"""Circle, square, triangle and diamond as SVG paths of about the unit circle's size, each with a pattern of dashes."""


class Look(msgspec.Struct, frozen=True):
    """Colour; marker, a path around the origin of size 1; and dashes, empty for a solid line."""

    colour: str
    marker: str
    dash: str


def looks_of(arms: Iterable[str]) -> dict[str, Look]:
    """A look for each arm: Tableau's ten colours (matplotlib) by four markers, so that forty differ.

    Neighbours differ in both: who cannot tell two colours apart has the markers.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    try:
        from matplotlib.colors import TABLEAU_COLORS, to_hex
    except ImportError as e:
        raise MissingExtraError("report", f"needs {e.name}", "; run: pip install 'foreshock[campaign]'") from e
    colours = [to_hex(c) for c in TABLEAU_COLORS.values()]
    return {arm: Look(colours[k % 10], *SHAPES[(k + k // 10) % 4]) for k, arm in enumerate(arms)}
