"""A campaign on the plant that misbehaves on purpose: quick, and it can do all that a twin can do to a run."""

from __future__ import annotations

from pathlib import Path

import pytest

ROGUE = Path(__file__).parents[1] / "rogues" / "fmus" / "rogue"

SCENARIO = f"""
id = "rogue"
title = "A plant that misbehaves"
mode = "A9"
expect = "open"
duration_s = 0.3

[twin]
kind = "fmu"
plant = "{ROGUE}"
binding = "{ROGUE / "binding.toml"}"

[config.supervisor]
period_s = 0.001

[[config.detectors]]
use = "telemetry"
"""

CAMPAIGN = """
id = "rogues"
replicates = 12
seed = 5

[[scenarios]]
use = "rogue.toml"

[[arms]]
id = "none"
kind = "none"

[[arms]]
id = "shadow"
kind = "shadow"

[[arms]]
id = "on"
kind = "on"

[[arms]]
id = "random"
kind = "random"

[[arms]]
id = "always"
kind = "always"
"""


@pytest.fixture
def campaign_file(tmp_path: Path) -> Path:
    """The campaign, with its scenario beside it."""
    (tmp_path / "rogue.toml").write_text(SCENARIO)
    file = tmp_path / "rogues.toml"
    file.write_text(CAMPAIGN)
    return file
