from __future__ import annotations

from pathlib import Path

import pytest

from foreshock_twins.fmi import FmiTwinConfig, build_twin

TESTS = Path(__file__).parents[1]
OSCILLATOR = TESTS / "twins" / "plants" / "oscillator"
ROGUE = TESTS / "rogues" / "fmus" / "rogue"


@pytest.fixture(scope="session", autouse=True)
def fmu_cache(tmp_path_factory):
    """Built FMUs of this test session; the user's cache is left alone."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("cache")
        patch.setenv("FORESHOCK_CACHE", str(folder))
        yield folder


@pytest.fixture
def make_twin(tmp_path):
    """Builds twins in tmp_path and closes them."""
    made = []

    def make(robot="talos", **config):
        twin = build_twin(FmiTwinConfig(**config), robot, tmp_path)
        made.append(twin)
        return twin

    yield make
    for twin in made:
        twin.close()


@pytest.fixture
def rogue(make_twin):
    return make_twin(plant=str(ROGUE))


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def oscillator(request, make_twin):
    return make_twin(plant=str(OSCILLATOR), fmi_version=request.param)
