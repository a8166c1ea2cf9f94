"""Scenarios of the MuJoCo twin: found beside those of the FMU plants, calm when nothing is wrong, saved on ice."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from foreshock.errors import ConfigError
from foreshock.registry import Registry
from foreshock.session.isolated import build_twin
from foreshock.session.run import Run
from foreshock.session.scenario import Scenario, find_scenario, load_scenario, scenario_ids
from foreshock.session.simulate import simulate
from foreshock.supervisor import Supervisor
from foreshock.twin import Twin
from foreshock_twins.mujoco._parameters import PARAMETERS, values_of

REGISTRY = Registry()
PLAIN = scenario_ids(REGISTRY)
VARIANTS = {id_: s for id_, s in scenario_ids(REGISTRY, variants=True).items() if id_.endswith("@mujoco")}


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> Twin:
    pytest.importorskip("mujoco")
    return build_twin(VARIANTS["a1-fall-ice@mujoco"], REGISTRY, tmp_path_factory.mktemp("twin"))


def run(scenario: Scenario, twin: Twin, arm: str, seed: int) -> Run:
    supervisor = Supervisor(scenario.supervisor(), Path(scenario.folder), REGISTRY)
    try:
        return simulate(scenario, twin, supervisor, arm, seed, detail=False)  # type: ignore[arg-type]  # one of Arm's
    finally:
        supervisor.close()


@pytest.mark.parametrize("id_", sorted(k for k in PLAIN if k.startswith(("a1-", "a2-", "a3-"))))
def test_a_scenario_has_a_variant_on_the_twin_and_keeps_its_own(id_: str) -> None:
    own, variant = find_scenario(id_, REGISTRY), find_scenario(id_, REGISTRY, "mujoco")
    assert own.twin["kind"] == "fmu"
    assert variant.twin["kind"] == "mujoco"
    assert (variant.mode, variant.expect == "none") == (own.mode, own.expect == "none")
    assert find_scenario(id_, REGISTRY, "fmu") == own


def test_variants_are_not_run_unasked() -> None:
    assert VARIANTS
    assert not any("@" in id_ for id_ in PLAIN)


def test_a_variant_names_its_twin(tmp_path: Path) -> None:
    path = Path(VARIANTS["a1-fall-ice@mujoco"].folder) / "a1-fall-ice.toml"
    other = tmp_path / "other.toml"
    other.write_text(path.read_text().replace('kind = "mujoco"', 'kind = "fmu"'))
    with pytest.raises(ConfigError, match="names another twin than twin\\.kind"):
        load_scenario(other)


def test_all_parameters_are_those_of_the_twin() -> None:
    for scenario in VARIANTS.values():
        assert values_of(scenario.drawn(1)).keys() == PARAMETERS.keys()


@pytest.mark.parametrize("id_", ["a1-fall-ice@mujoco", "a2-arm-torso-strike@mujoco", "a3-leg-swing-contact@mujoco"])
def test_the_detectors_find_their_channels(id_: str, twin: Twin) -> None:
    scenario = msgspec.structs.replace(VARIANTS[id_], duration_s=1.7)
    states = {h.source: h.state for h in run(scenario, twin, "on", 1).health}
    assert {d["use"]: states[d["use"]] for d in scenario.config["detectors"]} == {
        d["use"]: "ok" for d in scenario.config["detectors"]
    }


def test_who_comes_onto_ice_falls_and_does_not_where_the_cause_decides(twin: Twin) -> None:
    scenario = VARIANTS["a1-fall-ice@mujoco"]
    alone, saved = run(scenario, twin, "shadow", 60001), run(scenario, twin, "on", 60001)
    assert alone.accident
    assert alone.outcome == "fall"
    assert [e.mode for e in alone.events if e.id == "fall"] == ["A1"]
    assert not saved.events
    assert {i.action for i in saved.interventions if i.strength > 0.0} == {"step-suppression"}


@pytest.mark.parametrize(
    ("id_", "values"),
    [("a1-fall-onto-human-nominal", {"step_length": 0.2}), ("a1-fall-onto-human-nominal-standing", {})],
)
def test_nothing_is_done_while_nothing_is_wrong(id_: str, values: dict[str, float], twin: Twin) -> None:
    scenario = msgspec.structs.replace(find_scenario(id_, REGISTRY, "mujoco").with_(values), duration_s=5.0)
    calm = run(scenario, twin, "on", 50001)
    assert not calm.events
    assert not calm.interventions
    assert not calm.first_s
