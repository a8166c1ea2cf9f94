"""Scenario files of plugins: a broken one is named with its plugin and hides no other; wrong values are refused."""

from __future__ import annotations

import math
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foreshock.errors import ConfigError
from foreshock.hookspecs import hookimpl
from foreshock.registry import Registry
from foreshock.session.scenario import Scenario, broken_scenarios, find_scenario, load_scenario, scenario_ids
from foreshock.taxonomy import builtin_taxonomy

FILE = """
id = "{id}"
title = "a made-up situation"
mode = "{mode}"
expect = "open"
duration_s = {duration}
[twin]
kind = "fmu"
[config]
[parameters]
drop_mu = {mu}
"""
SHIPPED = "a1-fall-onto-human"


def written(path, id_="stranger", mode="A2", duration="2.5", mu="0.05"):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(FILE.format(id=id_, mode=mode, duration=duration, mu=mu))
    return path


def plugin(*given_files):
    """A plugin module that offers these."""
    module = ModuleType("stranger")

    def foreshock_scenarios():
        return list(given_files)

    module.foreshock_scenarios = hookimpl(foreshock_scenarios)
    return module


def raising():
    module = ModuleType("raising")

    def foreshock_scenarios():
        raise RuntimeError("no disk")

    module.foreshock_scenarios = hookimpl(foreshock_scenarios)
    return module


@pytest.fixture
def shipped():
    """Ids of the scenarios that are installed anyway."""
    known = set(scenario_ids(Registry()))
    assert SHIPPED in known
    return known


def test_what_is_installed_is_whole(shipped):
    assert broken_scenarios(Registry()) == ()


BROKEN = {
    "nowhere": (lambda folder: Path("/nowhere/zzz.toml"), "/nowhere/zzz.toml"),
    "a folder": (lambda folder: folder, "Is a directory"),
    "no path at all": (lambda folder: Path("zzz\0.toml"), "null"),
    "not TOML": (lambda folder: _text(folder, "id = "), "not TOML"),
    "unknown key": (lambda folder: _text(folder, "tilte = 1"), "unknown key"),
    "a wrong mode": (lambda folder: written(folder / "zzz.toml", mode="A77"), "did you mean 'A7'"),
}


def _text(folder, text):
    (folder / "zzz.toml").write_text(text)
    return folder / "zzz.toml"


@pytest.mark.parametrize(("make", "says"), BROKEN.values(), ids=BROKEN)
def test_a_broken_file_hides_no_other(tmp_path, shipped, make, says):
    good = written(tmp_path / "good" / "good.toml")
    registry = Registry({"zzz-plugin": plugin(make(tmp_path), good)})
    assert set(scenario_ids(registry)) == {*shipped, "stranger"}  # not even one of the same plugin
    assert find_scenario(SHIPPED, registry).id == SHIPPED
    assert find_scenario("stranger", registry).duration_s == 2.5
    (broken,) = broken_scenarios(registry)
    assert broken.name == "zzz-plugin"
    assert says in broken.reason


@pytest.mark.parametrize(
    ("module", "says"),
    [(raising(), "raised RuntimeError: no disk"), (plugin("a.toml"), "gave a str, Path is expected")],
    ids=["raises", "gives-text"],
)
def test_a_broken_hook_hides_no_plugin(shipped, module, says):
    registry = Registry({"zzz-plugin": module})
    assert set(scenario_ids(registry)) == shipped
    (broken,) = broken_scenarios(registry)
    assert broken.name == "zzz-plugin"
    assert says in broken.reason


def test_a_name_that_is_not_found_mentions_what_could_not_be_read():
    modules = {"zzz-plugin": plugin(Path("/nowhere/zzz.toml")), "yyy-plugin": ModuleType("yyy")}
    modules["yyy-plugin"].foreshock_scenario = list  # a misspelt hook
    with pytest.raises(ConfigError) as caught:
        find_scenario("a1-fall-onto-humn", Registry(modules))
    message = str(caught.value)
    assert f"no scenario 'a1-fall-onto-humn'; did you mean {SHIPPED!r}" in message
    assert "plugin zzz-plugin is left out: /nowhere/zzz.toml: No such file or directory" in message
    assert "plugin yyy-plugin is left out: " in message


def test_an_id_that_two_files_claim_is_nobodys(tmp_path, shipped):
    """A stranger's file cannot replace a shipped scenario unseen; all others stay."""
    mine, other = written(tmp_path / "mine.toml", SHIPPED), written(tmp_path / "other.toml", "other")
    registry = Registry({"zzz-plugin": plugin(mine, other)})
    assert set(scenario_ids(registry)) == {*shipped, "other"} - {SHIPPED}
    with pytest.raises(ConfigError) as caught:
        find_scenario(SHIPPED, registry)
    theirs = Path(find_scenario(f"{SHIPPED}-nominal", registry).folder) / f"{SHIPPED}.toml"
    for path in (mine, theirs):
        assert f"{path} of plugin " in str(caught.value)
    assert {"zzz-plugin"} < {b.name for b in broken_scenarios(registry)}


def test_one_file_of_two_plugins_is_one_scenario(tmp_path, shipped):
    path = written(tmp_path / "mine.toml")
    detour = tmp_path / "elsewhere" / ".." / "mine.toml"
    detour.parent.parent.mkdir()
    registry = Registry({"yyy-plugin": plugin(path), "zzz-plugin": plugin(detour)})
    assert set(scenario_ids(registry)) == {*shipped, "stranger"}
    assert broken_scenarios(registry) == ()


@pytest.mark.parametrize(
    ("change", "place", "says"),
    [
        ({"duration": "0.0"}, "duration_s", "0.0 is not a finite number above 0"),
        ({"duration": "-1.0"}, "duration_s", "-1.0 is not"),
        ({"duration": "inf"}, "duration_s", "inf is not"),
        ({"duration": "nan"}, "duration_s", "nan is not"),
        ({"mode": "A77"}, "mode", "'A77' is not the code of an accident mode; did you mean 'A7'"),
        ({"mode": ""}, "mode", "'' is not the code"),
        ({"mode": "a1"}, "mode", "'a1' is not the code"),
        ({"mu": "nan"}, "parameters.drop_mu", "nan is not a finite number"),
        ({"mu": "-inf"}, "parameters.drop_mu", "-inf is not a finite number"),
    ],
)
def test_a_wrong_value_is_refused_with_its_place(tmp_path, change, place, says):
    path = written(tmp_path / "wrong.toml", **change)
    with pytest.raises(ConfigError) as caught:
        load_scenario(path)
    assert caught.value.place == f"{path}: stranger: {place}"
    assert says in str(caught.value)


@pytest.mark.parametrize("mode", builtin_taxonomy().codes)
def test_every_mode_of_the_taxonomy_has_room(tmp_path, mode):
    assert load_scenario(written(tmp_path / "fine.toml", mode=mode)).mode == mode


def test_a_parameter_of_the_command_line_is_checked_as_well():
    scenario = Scenario("made-up", "by hand", "A1", "open", 1.0, {"kind": "fmu"}, {})
    assert scenario.with_({"drop_mu": 0.1}).parameters == {"drop_mu": 0.1}
    with pytest.raises(ConfigError, match=r"made-up: parameters\.drop_mu: nan is not a finite number"):
        scenario.with_({"drop_mu": math.nan})


@given(st.floats())
def test_a_duration_is_accepted_only_if_time_can_pass_and_end(duration_s):
    fits = math.isfinite(duration_s) and duration_s > 0.0
    try:
        Scenario("made-up", "by hand", "A1", "open", duration_s, {"kind": "fmu"}, {})
    except ConfigError:
        assert not fits
    else:
        assert fits


DRAWN = """
[distributions.push]
uniform = [1.0, 3.0]
[distributions.mass]
normal = [2.0, 0.5]
[distributions.foot]
choice = [0.0, 1.0]
"""


def test_each_seed_draws_its_parameters_and_a_fixed_value_takes_their_place(tmp_path):
    path = written(tmp_path / "drawn.toml")
    path.write_text(path.read_text() + DRAWN)
    scenario = load_scenario(path)
    draws = [scenario.drawn(seed) for seed in range(2000)]
    assert scenario.drawn(3) == draws[3] != draws[4]
    push, mass, foot = (np.array([d[n] for d in draws]) for n in ("push", "mass", "foot"))
    # mean within four standard errors, of a uniform, a normal and a fair coin
    assert push.mean() == pytest.approx(2.0, abs=4 * 2.0 / math.sqrt(12 * 2000))
    assert (push.min() >= 1.0, push.max() < 3.0) == (True, True)
    assert mass.mean() == pytest.approx(2.0, abs=4 * 0.5 / math.sqrt(2000))
    assert np.abs(mass - 2.0).max() <= 1.5
    assert set(foot) == {0.0, 1.0}
    assert abs(np.corrcoef(push, mass)[0, 1]) < 4 / math.sqrt(2000)
    fixed = scenario.with_({"push": 9.0})
    assert all(fixed.drawn(s) == {**scenario.drawn(s), "push": 9.0} for s in range(20))


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("drop_mu = { uniform = [0.0, 1.0] }", "has a fixed value under parameters as well"),
        ("x = { uniform = [2.0, 1.0] }", "low 2.0 is above high 1.0"),
        ("x = { normal = [2.0, -1.0] }", "standard deviation -1.0"),
        ("x = { normal = [2.0, 1.0], choice = [1.0] }", "2 of uniform, normal and choice"),
        ("x = {}", "0 of uniform, normal and choice"),
        ("x = { choice = [nan] }", "not finite"),
        ("x = { unifrom = [0.0, 1.0] }", "did you mean 'uniform'"),
    ],
)
def test_a_wrong_distribution_is_refused(tmp_path, table, said):
    path = written(tmp_path / "wrong.toml")
    path.write_text(path.read_text() + f"[distributions]\n{table}\n")
    with pytest.raises(ConfigError) as caught:
        load_scenario(path)
    assert said in str(caught.value)
