"""FMUs connected to each other: equal to the whole within the coupling's error; every mistake is named."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description

from foreshock._strict import convert
from foreshock.errors import ConfigError, TwinError
from foreshock.records import Intervention
from foreshock.registry import Registry
from foreshock.session.isolated import build_twin as build_scenario_twin
from foreshock.session.scenario import load_scenario
from foreshock.session.simulate import simulate
from foreshock.supervisor import Supervisor
from foreshock_fmus import build_fmu, read_plant
from foreshock_twins import system
from foreshock_twins.fmi import FmiTwinConfig
from foreshock_twins.fmi import build_twin as build_one
from foreshock_twins.system import FmuSystemConfig, build_twin

PLANTS = Path(__file__).parent / "plants"
EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "elastic-joint"
GAIN = str(PLANTS / "gain")
MS = 1_000_000
JOINT = [
    {"from": "drive.torque", "to": "link.torque"},
    {"from": "link.angle", "to": "drive.link_angle"},
    {"from": "link.rate", "to": "drive.link_rate"},
]


def binding(folder: Path, text: str, step_s: float = 0.001, head: str = "") -> str:
    path = folder / "binding.toml"
    path.write_text(f"[binding]\nstep_s = {step_s}\n{head}\n{text}")
    return str(path)


def make(folder: Path, parts: dict, connections: list, text: str = "", head: str = "", step_s: float = 0.001, **more):
    table = {"binding": binding(folder, text, step_s, head), "parts": parts, "connections": connections, **more}
    return build_twin(convert(table, FmuSystemConfig, "twin"), "robot", folder)


def joint(folder: Path, step_s: float, version: int = 3, coupling: str = "gauss-seidel"):
    parts = {name: {"plant": str(EXAMPLE / name), "fmi_version": version} for name in ("drive", "link")}
    text = '[probes]\nangle = "link.angle"\ntorque = "drive.torque"'
    return make(folder, parts, JOINT, text, step_s=step_s, coupling=coupling)


def course(twin, step_s: float, seconds: float = 2.0) -> np.ndarray:
    """The link's angle every 20 ms."""
    twin.reset({}, 0)
    out = []
    for k in range(1, round(seconds / 0.02) + 1):
        twin.advance(round(k * 0.02 * 1e9))
        out.append(twin.probes()["angle"])
    twin.close()
    return np.array(out)


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> np.ndarray:
    """The course of drive and link in one FMU."""
    folder = tmp_path_factory.mktemp("whole")
    path = binding(folder, '[probes]\nangle = "angle"')
    config = FmiTwinConfig(plant=str(PLANTS / "elastic_joint"), binding=path)
    return course(build_one(config, "robot", folder), 0.001)


@pytest.mark.parametrize("coupling", ["gauss-seidel", "jacobi"])
def test_two_fmus_equal_the_whole_and_the_error_halves_with_the_step(tmp_path, whole, coupling) -> None:
    """Inputs held over a step couple with first order: the global error is O(h), in either scheme."""
    errors = [np.abs(course(joint(tmp_path, h, coupling=coupling), h) - whole).max() for h in (0.001, 0.0005, 0.00025)]
    assert np.ptp(whole) > 0.5
    assert errors[0] < 0.01
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.25)
    assert errors[1] / errors[2] == pytest.approx(2.0, abs=0.25)


def test_fmi_2_and_3_give_the_same_and_a_reset_is_as_good_as_new(tmp_path) -> None:
    first = course(joint(tmp_path, 0.001, version=2), 0.001, 0.5)
    twin = joint(tmp_path, 0.001)
    twin.reset({"drive.amplitude": 0.1}, 0)
    twin.advance(300 * MS)
    np.testing.assert_array_equal(first, course(twin, 0.001, 0.5))


def test_the_example_runs_under_a_supervisor_and_its_intervention_acts(tmp_path) -> None:
    scenario = load_scenario(EXAMPLE / "scenario.toml")
    registry = Registry({"fmu-system": system})
    twin = build_scenario_twin(scenario, registry, tmp_path)
    judge = Supervisor(scenario.supervisor(), EXAMPLE, registry)
    run = simulate(scenario, twin, judge, "on", 1)
    assert run.outcome == "none"
    assert run.ignored == ()
    twin.reset({}, 0)
    twin.advance(150 * MS)
    free = twin.probes()["angle"]
    twin.reset({}, 0)
    twin.intervene(Intervention(0, "derate", 1.0))
    twin.advance(150 * MS)
    assert 0.0 < twin.probes()["angle"] < 0.8 * free  # a fifth of the torque
    samples = twin.advance(200 * MS)
    assert {s.channel for s in samples} == {"arm/joints/state"}
    twin.close()


def test_a_chain_is_stepped_in_its_own_order_and_passes_through_in_one_step(tmp_path) -> None:
    """c <- b <- a, named against the order; y = k u + b, so that c = 1 + (1 + 1 / 2) / 2."""
    parts = {name: {"plant": GAIN} for name in ("c", "b", "a")}
    chain = [{"from": "b.y", "to": "c.u"}, {"from": "a.y", "to": "b.u"}]
    text = '[probes]\nlast = "c.y"\nfed = "c.u"'
    twin = make(tmp_path, parts, chain, text)
    twin.reset({}, 0)
    assert twin.probes()["last"] == 1.75  # at the start already
    twin.reset({"a.b": 3.0}, 0)
    twin.advance(MS)
    assert twin.probes() == {"last": 2.25, "fed": 2.5}
    twin.close()
    late = make(tmp_path, parts, chain, text, coupling="jacobi")
    late.reset({"a.b": 3.0}, 0)
    late.advance(MS)
    assert late.probes()["fed"] == 2.5  # every output at the start was consistent with its input
    late.close()


def test_an_algebraic_loop_is_refused_with_its_cycle_and_a_delay_makes_it_an_iteration(tmp_path) -> None:
    parts = {name: {"plant": GAIN} for name in ("a", "b")}
    loop = [{"from": "a.y", "to": "b.u"}, {"from": "b.y", "to": "a.u"}]
    with pytest.raises(ConfigError) as caught:
        make(tmp_path, parts, loop)
    cycle = str(caught.value).partition("algebraic loop: ")[2].partition(";")[0].split(" -> ")
    assert cycle[0] == cycle[-1]
    assert set(cycle) == {"a.y", "b.u", "b.y", "a.u"}
    assert "delayed = true" in str(caught.value)
    loop[1]["delayed"] = True
    twin = make(tmp_path, parts, loop, '[probes]\ny = "a.y"')
    twin.reset({}, 0)
    twin.advance(60 * MS)
    assert twin.probes()["y"] == pytest.approx(2.0, abs=1e-9)  # y = 1 + (1 + y / 2) / 2
    twin.close()


def test_a_part_that_feeds_itself_directly_is_a_loop_too_and_through_its_state_is_none(tmp_path) -> None:
    parts = {"a": {"plant": GAIN}}
    with pytest.raises(ConfigError, match=r"algebraic loop: a\.(u|y) -> a\.(u|y) -> a\.(u|y)"):
        make(tmp_path, parts, [{"from": "a.y", "to": "a.u"}])
    make(tmp_path, parts, [{"from": "a.kept", "to": "a.u"}]).close()


def test_an_output_whose_dependence_is_not_said_counts_as_direct(tmp_path) -> None:
    parts = {name: {"plant": GAIN} for name in ("a", "b")}
    loop = [{"from": "a.unsaid", "to": "b.u"}, {"from": "b.y", "to": "a.u"}]
    with pytest.raises(ConfigError, match=r"algebraic loop.*what 'a\.unsaid' depends on is not said"):
        make(tmp_path, parts, loop)


@pytest.mark.parametrize("version", [2, 3])
def test_a_plant_declares_what_its_outputs_depend_on(version) -> None:
    description = read_model_description(build_fmu(GAIN, version))
    found = {u.variable.name: u.dependencies for u in description.outputs}
    assert [v.name for v in found["y"]] == ["u"]
    assert found["kept"] == []
    assert found["unsaid"] is None


def test_the_seed_of_the_run_reaches_every_part_that_asks_for_it(tmp_path) -> None:
    parts = {"a": {"plant": GAIN}, "b": {"plant": GAIN, "seed": "seed"}}
    text = '[probes]\na = "a.seen_seed"\nb = "b.seen_seed"'
    twin = make(tmp_path, parts, [], text, 'seed = "a.seed"')
    twin.reset({}, 41)
    assert twin.probes() == {"a": 41.0, "b": 42.0}
    twin.close()


def test_an_error_of_a_part_names_it(tmp_path) -> None:
    parts = {"a": {"plant": GAIN}, "b": {"plant": GAIN}}
    twin = make(tmp_path, parts, [{"from": "a.y", "to": "b.u"}], '[probes]\ny = "b.y"')
    with pytest.raises(TwinError, match=r"part 'b'.*'y' is inf"):
        twin.reset({"a.b": 1.7e308, "a.k": 1.0, "b.k": 10.0}, 0)
    twin.close()


MISTAKES = [
    ([{"from": "a.yy", "to": "b.u"}], "connections[0].from", "part 'a' has no variable 'yy'; did you mean 'a.y'"),
    ([{"from": "aa.y", "to": "b.u"}], "connections[0].from", "'aa.y' is not <part>.<variable>; did you mean 'a'"),
    ([{"from": "y", "to": "b.u"}], "connections[0].from", "'y' is not <part>.<variable>"),
    ([{"from": "a.u", "to": "b.u"}], "connections[0].from", "'a.u' is of causality input, output is expected"),
    ([{"from": "a.y", "to": "b.k"}], "connections[0].to", "'b.k' is of causality parameter, input is expected"),
    ([{"from": "a.y", "to": "b.angle"}], "connections[0]", "'a.y' is in 'm', 'b.angle' in 'rad'"),
    ([{"from": "a.length_mm", "to": "b.u"}], "connections[0]", "'a.length_mm' is in 'mm', 'b.u' in 'm'"),
    (
        [{"from": "a.y", "to": "b.u"}, {"from": "a.kept", "to": "b.u"}],
        "connections[1].to",
        "'b.u' is fed twice, by connections[0] as well",
    ),
    ([{"from": "a.y", "too": "b.u"}], "connections[0].too", "did you mean 'to'"),
]


@pytest.mark.parametrize(("connections", "place", "says"), MISTAKES, ids=[m[2][:40] for m in MISTAKES])
def test_wrong_connections_are_named(tmp_path, connections, place, says) -> None:
    with pytest.raises(ConfigError) as caught:
        make(tmp_path, {"a": {"plant": GAIN}, "b": {"plant": GAIN}}, connections)
    assert place in str(caught.value)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({}, "twin.parts: is empty"),
        ({"a.b": {"plant": GAIN}}, "'a.b' is no name"),
        ({"a": {}}, "twin.parts.a: give one of plant and fmu"),
        ({"a": {"fmu": "nowhere.fmu"}}, "twin.parts.a.fmu: there is no file 'nowhere.fmu'"),
        ({"a": {"plant": GAIN, "seed": "sead"}}, "did you mean 'seed'"),
        ({"a": {"plant": GAIN, "seed": "u"}}, "expected a parameter"),
        ({"a": {"plant": GAIN, "seed": "seed"}}, "give binding.seed"),
    ],
)
def test_wrong_parts_are_named(tmp_path, parts, says) -> None:
    with pytest.raises(ConfigError) as caught:
        make(tmp_path, parts, [])
    assert says in str(caught.value)


def test_an_intervention_on_a_connected_input_and_an_unknown_variable_are_refused(tmp_path) -> None:
    parts, feed = {"a": {"plant": GAIN}, "b": {"plant": GAIN}}, [{"from": "a.y", "to": "b.u"}]
    with pytest.raises(ConfigError, match="of causality connected, but an intervention sets an input"):
        make(tmp_path, parts, feed, '[[interventions]]\naction = "derate"\ninputs = { "b.u" = 1.0 }')
    with pytest.raises(ConfigError, match=r"no variable 'b.yy'; did you mean 'b.y'"):
        make(tmp_path, parts, feed, '[probes]\ny = "b.yy"')
    twin = make(tmp_path, parts, feed)
    with pytest.raises(ConfigError, match=r"no parameter 'a.kk'"):
        twin.reset({"a.kk": 1.0}, 0)
    assert math.isclose(twin.period_ns, MS)
    twin.close()


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('depends = ["u"]', 'depends = ["uu"]', "y.depends: there is no input 'uu'; did you mean 'u'"),
        ('depends = ["u"]', 'depends = "u"', "expected a list of inputs"),
        (
            'name = "u", causality = "input"',
            'name = "u", depends = [], causality = "input"',
            "is given, but input is its causality",
        ),
    ],
)
def test_a_wrong_dependence_of_a_plant_is_named(tmp_path, old, new, says) -> None:
    text = (PLANTS / "gain" / "gain.toml").read_text()
    assert old in text
    (tmp_path / "gain.toml").write_text(text.replace(old, new))
    with pytest.raises(ConfigError) as caught:
        read_plant(tmp_path / "gain.toml")
    assert says in str(caught.value)
