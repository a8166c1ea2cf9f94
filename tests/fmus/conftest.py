from __future__ import annotations

from pathlib import Path

import pytest

PLANTS = Path(__file__).parent / "plants"


@pytest.fixture(scope="session")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("fmus")


@pytest.fixture(scope="session")
def oscillator():
    return PLANTS / "oscillator"
