"""Makes the plugins of this folder installed ones: a distribution of that name with real entry points."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

GALLERY = {
    "bad-import": "rogue_bad_import",
    "bad-kind": "rogue_bad_kind",
    "exits": "rogue_exits",
    "gives-names": "rogue_gives_names",
    "gives-nothing": "rogue_gives_nothing",
    "knee-torque": "good_knee",
    "misspelt-hook": "rogue_misspelt_hook",
    "misspelt-unmarked": "rogue_misspelt_unmarked",
    "needs-extra": "needs_extra",
    "other-id": "rogue_other_id",
    "raises": "rogue_raises",
    "unmarked": "rogue_unmarked",
    "wrong-signature": "rogue_wrong_signature",
}


def install(folder: Path, plugins: Mapping[str, str] = GALLERY) -> Path:
    """Write the distribution; the folder then belongs on sys.path."""
    info = folder / "rogue_gallery-1.2.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: rogue-gallery\nVersion: 1.2\n")
    points = "\n".join(f"{name} = tests.rogues.plugins.{module}" for name, module in plugins.items())
    (info / "entry_points.txt").write_text(f"[foreshock]\n{points}\n")
    return folder
