"""Every plant that ships: valid in both FMI versions, bound without a mistake, the same samples from both."""

from __future__ import annotations

import pytest
from fmpy.validation import validate_fmu

from foreshock.messages import is_finite
from foreshock_fmus import build_fmu, plants

PLANTS = sorted(plants())


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("version", [2, 3])
def test_it_is_valid(plant, version):
    assert validate_fmu(str(build_fmu(plant, version))) == []


@pytest.mark.parametrize("plant", PLANTS)
def test_both_versions_give_the_same_run(plant, make_twin):
    runs = []
    for version in (2, 3):
        twin = make_twin(plant=plant, fmi_version=version)
        for action in sorted(twin.actions):
            assert action == action.lower()
        twin.reset({}, 11)
        period = twin.period_ns
        samples = [s for k in range(1, 201) for s in twin.advance(k * period)]
        assert samples
        assert all(is_finite(s.value) for s in samples)
        assert {s.channel for s in samples} <= {f"talos/{c.name}" for c in twin.channels}
        runs.append((samples, list(twin.events()), dict(twin.probes())))
    assert runs[0] == runs[1]


@pytest.mark.parametrize("plant", PLANTS)
def test_the_seed_decides_the_noise(plant, make_twin):
    twin = make_twin(plant=plant)
    runs = []
    for seed in (1, 1, 2):
        twin.reset({}, seed)
        runs.append(twin.advance(100 * twin.period_ns))
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]
