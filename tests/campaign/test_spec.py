"""A campaign file: what is refused and how, and which runs it comes to."""

from __future__ import annotations

import json
import math
from pathlib import Path
from statistics import NormalDist
from typing import Any

import jsonschema
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

import foreshock
from foreshock._strict import read_toml
from foreshock.campaign import campaign_schema, load_campaign, parse_campaign, plan_of, shipped
from foreshock.campaign.identity import changes
from foreshock.campaign.plan import merged
from foreshock.campaign.sampling import points_of, quantile
from foreshock.campaign.spec import CampaignSpec, Factor
from foreshock.errors import ConfigError
from foreshock.registry import Registry
from foreshock.session.scenario import scenario_ids
from foreshock_detectors import baselines

LEAST: dict[str, Any] = {"id": "c", "scenarios": [{"use": "a1-fall-onto-human"}], "arms": [{"id": "on", "kind": "on"}]}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"replicas": 3}, "replicas: unknown key; did you mean 'replicates'"),
        ({"sampler": "sobel"}, "'sobel' is not one of .*did you mean 'sobol'"),
        ({"replicates": 0}, "replicates: 0 is not a finite number at least 1"),
        ({"arms": []}, "arms: is empty"),
        ({"arms": [{"id": "on", "kind": "on"}] * 2}, "id 'on' is given twice"),
        (
            {"arms": [{"id": "r", "kind": "random"}]},
            "an arm of kind .on., and there is none",
        ),
        ({"arms": [{"id": "n", "kind": "none", "policy": "ladder"}]}, "have no meaning for an arm of kind 'none'"),
        ({"reference": "shadw", "arms": [{"id": "shadow", "kind": "shadow"}]}, "did you mean 'shadow'"),
        ({"points": 4}, "points: has no meaning for a grid"),
        ({"sampler": "monte-carlo", "points": 4}, "factors: is empty"),
        ({"factors": [{"parameter": "x"}]}, "factors.x: 0 of values"),
        ({"factors": [{"parameter": "x", "uniform": [2, 1]}]}, "low 2.0 is not below high 1.0"),
        ({"factors": [{"parameter": "x", "values": [math.inf]}]}, "not finite"),
        ({"factors": [{"parameter": "x", "values": [0, 1, 0.0]}]}, r"factors\.x\.values: 0\.0 is given twice"),
        ({"factors": [{"parameter": "x", "log_uniform": [0, 1]}]}, "not a finite number above 0"),
        ({"factors": [{"parameter": "x", "uniform": [0, 1]}], "sampler": "sobol", "points": 6}, "no power of two"),
        ({"metrics": ["brierr"]}, "did you mean 'brier'"),
    ],
)
def test_what_is_wrong_is_named(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        parse_campaign({**LEAST, **change}, "c.toml")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"scenarios": [{"use": "a1-fall-on-human"}]}, "did you mean 'a1-fall-onto-human'"),
        ({"scenarios": [{"use": "a99-*"}]}, "no scenario matches"),
        ({"scenarios": [{"use": "a1-fall-onto-human"}, {"use": "a1-*"}]}, "a second time"),
        ({"factors": [{"parameter": "x", "values": [1], "scenarios": ["a2-*"]}]}, "none of the campaign's scenarios"),
        (
            {"factors": [{"parameter": "x", "values": [1]}, {"parameter": "x", "values": [2], "scenarios": ["a1-*"]}]},
            r"factors\.x: is given twice for scenario 'a1-fall-onto-human'",
        ),
        ({"arms": [{"id": "on", "kind": "on", "policy": "laddder"}]}, "did you mean 'ladder'"),
        ({"arms": [{"id": "on", "kind": "on", "config": {"risk": {"modle": 1}}}]}, "did you mean 'model'"),
        ({"budget": {"runs": 2}, "replicates": 3}, "2 runs, but the campaign has 3"),
    ],
)
def test_what_does_not_fit_the_plugins_is_named_before_a_run(change: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=said):
        plan_of(parse_campaign({**LEAST, **change}, "c.toml"), tmp_path, Registry())


@pytest.mark.parametrize("id_", sorted(shipped()))
def test_shipped_campaigns_fit_the_schema(id_: str) -> None:
    spec, _ = load_campaign(id_)
    assert spec.id == id_
    assert spec.title
    jsonschema.Draft202012Validator(campaign_schema()).validate(read_toml(shipped()[id_]))
    json.dumps(campaign_schema())


@pytest.mark.parametrize("id_", sorted(shipped()))
def test_shipped_campaigns_fit_the_plugins(id_: str) -> None:
    spec, folder = load_campaign(id_)
    # by name, so that it does not matter which version of the entry points is installed
    registry = Registry(dict.fromkeys(("reactive-stop", "capture-point", "speed-separation"), baselines))
    plan = plan_of(spec, folder, registry)
    assert {c.arm for c in plan.cases} == {a.id for a in spec.arms}
    assert {c.fault for c in plan.cases} == {"", *(f.id for f in spec.faults)}
    if id_ == "twelve-modes":
        shipped_scenarios = {k for k in scenario_ids(Registry()) if k.startswith("a")}
        assert set(plan.scenarios) == shipped_scenarios
        assert len({c.mode for c in plan.cases}) == 12


def test_arms_share_seeds_and_scripted_arms_follow_theirs() -> None:
    spec, folder = load_campaign("smoke")
    plan = plan_of(spec, folder, Registry())
    # two points and one, of two seeds, under five arms
    assert len(plan.cases) == (2 + 1) * 2 * 5
    assert len({c.key for c in plan.cases}) == len(plan.cases)
    by_arm: dict[str, set[tuple[str, int, int]]] = {}
    for c in plan.cases:
        by_arm.setdefault(c.arm, set()).add((c.scenario, c.point, c.seed))
    assert len({frozenset(v) for v in by_arm.values()}) == 1
    on = {c.key: c for c in plan.cases if c.arm == "on"}
    for c in plan.cases:
        if c.arm in ("random", "always"):
            source = on[c.source]
            assert (source.scenario, source.point, source.seed) == (c.scenario, c.point, c.seed)


def test_a_value_given_twice_is_a_weight_where_points_have_seeds_of_their_own() -> None:
    factors = [{"parameter": "drop_mu", "values": [0.04, 0.04, 0.06]}]
    spec = parse_campaign({**LEAST, "factors": factors, "sampler": "monte-carlo", "points": 8}, "c")
    cases = plan_of(spec, Path(), Registry()).cases
    assert len({c.seed for c in cases}) == 8


def test_one_parameter_can_have_a_factor_in_each_scenario() -> None:
    names = ("a1-fall-onto-human", "a1-fall-onto-human-nominal")
    factors = [{"parameter": "drop_mu", "values": [0.04 + 0.01 * k], "scenarios": [n]} for k, n in enumerate(names)]
    spec = parse_campaign({**LEAST, "scenarios": [{"use": n} for n in names], "factors": factors}, "c")
    cases = plan_of(spec, Path(), Registry()).cases
    assert {c.scenario: c.parameters["drop_mu"] for c in cases} == dict(zip(names, (0.04, 0.05), strict=True))


def test_sampled_points_have_seeds_of_their_own() -> None:
    factors = [{"parameter": "drop_mu", "uniform": [0.04, 0.06]}]
    sampled = {**LEAST, "factors": factors, "sampler": "monte-carlo", "points": 8, "replicates": 2, "seed": 3}
    plan = plan_of(parse_campaign(sampled, "c"), Path(), Registry())
    assert sorted(c.seed for c in plan.cases) == list(range(3, 3 + 16))


def test_a_key_depends_on_what_the_result_depends_on_and_on_nothing_else() -> None:
    def keys(**change: Any) -> set[str]:
        return {c.key for c in plan_of(parse_campaign({**LEAST, **change}, "c"), Path(), Registry()).cases}

    least = keys()
    assert keys(title="another title", metrics=["brier"], budget={"runs": 9}) == least
    for change in (
        {"seed": 1},
        {"scenarios": [{"use": "a1-fall-onto-human", "parameters": {"drop_mu": 0.05}}]},
        {"scenarios": [{"use": "a1-fall-onto-human", "duration_s": 3.0}]},
        {"arms": [{"id": "on", "kind": "shadow"}]},
        {"arms": [{"id": "on", "kind": "on", "config": {"gates": {"protective": 0.2}}}]},
    ):
        assert keys(**change).isdisjoint(least), change
    assert keys(replicates=2) > least


def test_tables_merge_and_lists_replace() -> None:
    base = {"gates": {"protective": 0.3, "modes": {"A6": {"latch": "protective"}}}, "policies": [{"use": "a"}]}
    change = {"gates": {"modes": {"A6": {"dwell_s": 1.0}}}, "policies": [{"use": "b"}]}
    assert merged(base, change) == {
        "gates": {"protective": 0.3, "modes": {"A6": {"latch": "protective", "dwell_s": 1.0}}},
        "policies": [{"use": "b"}],
    }


@given(st.floats(0.001, 0.999))
def test_quantiles_are_those_of_the_distribution(u: float) -> None:
    """Against scipy.stats; 1e-9 relative is well above the rounding of both."""
    assert quantile(Factor("x", uniform=(2.0, 5.0)), u) == pytest.approx(stats.uniform(2.0, 3.0).ppf(u), rel=1e-9)
    assert quantile(Factor("x", log_uniform=(0.1, 10.0)), u) == pytest.approx(
        stats.loguniform(0.1, 10.0).ppf(u), rel=1e-9
    )
    assert quantile(Factor("x", normal=(1.0, 0.5)), u) == pytest.approx(stats.norm(1.0, 0.5).ppf(u), rel=1e-9, abs=1e-9)


def _spec(sampler: str, **more: Any) -> CampaignSpec:
    factors = [{"parameter": "x", "uniform": [0, 1]}, {"parameter": "y", "normal": [0, 1], "levels": 3}]
    return parse_campaign({**LEAST, "factors": factors, "sampler": sampler, **more}, "c")


@pytest.mark.parametrize("sampler", ["monte-carlo", "latin-hypercube", "sobol"])
def test_samplers_repeat_and_differ_between_scenarios(sampler: str) -> None:
    spec = _spec(sampler, points=64)
    one, same, other = (points_of(spec, spec.factors, name) for name in ("a", "a", "b"))
    assert one == same
    assert one != other
    assert len(one) == 64
    again = points_of(msgspec.structs.replace(spec, seed=1), spec.factors, "a")
    assert again != one


@pytest.mark.parametrize("sampler", ["latin-hypercube", "sobol"])
def test_stratified_samplers_put_one_point_in_each_part(sampler: str) -> None:
    spec = _spec(sampler, points=64)
    points = points_of(spec, spec.factors, "a")
    x = np.array([p["x"] for p in points])
    y = np.array([NormalDist().cdf(p["y"]) for p in points])
    assert sorted(np.floor(64 * x)) == list(range(64))
    assert sorted(np.floor(64 * y)) == list(range(64))


def test_a_grid_is_the_product_of_levels() -> None:
    spec = _spec("grid")
    points = points_of(spec, spec.factors, "a")
    assert len(points) == 5 * 3
    assert sorted({p["x"] for p in points}) == pytest.approx([0.1, 0.3, 0.5, 0.7, 0.9])
    assert sorted({p["y"] for p in points}) == pytest.approx(
        [NormalDist().inv_cdf(u) for u in (1 / 6, 0.5, 5 / 6)], abs=1e-12
    )


def test_a_key_depends_on_what_is_in_the_files_that_a_configuration_names(tmp_path: Path) -> None:
    shipped_set = Path(foreshock.__file__).parent / "data" / "parameters" / "table-3.toml"
    file = tmp_path / "mine.toml"
    file.write_text(shipped_set.read_text())
    config = {"risk": {"model": "correlated", "parameters": str(file)}}
    spec = parse_campaign({**LEAST, "arms": [{"id": "on", "kind": "on", "config": config}]}, "c")
    before, same = (plan_of(spec, Path(), Registry()) for _ in range(2))
    assert [c.key for c in before.cases] == [c.key for c in same.cases]
    file.write_text(file.read_text() + "# another\n")
    after = plan_of(spec, Path(), Registry())
    assert {c.key for c in after.cases}.isdisjoint(c.key for c in before.cases)
    (said,) = changes(before.identity, after.identity)
    assert said.startswith("files.a1-fall-onto-human, on.")
    assert str(file) in said
