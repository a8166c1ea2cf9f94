"""Bad input in any arm or fault ends a campaign before its bulk; an arm's files lie beside the campaign's file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import foreshock
from foreshock.campaign import Campaign, Estimate, begin, execute, parse_campaign
from foreshock.errors import BadInputError, ConfigError
from foreshock.registry import Registry

TABLE_3 = Path(foreshock.__file__).parent / "data" / "parameters" / "table-3.toml"
NONE, ON = {"id": "none", "kind": "none"}, {"id": "on", "kind": "on"}


def begun(campaign_file: Path, folder: Path, arms: list[dict[str, Any]], *faults: dict[str, Any]) -> Campaign:
    """Forty seeds under each arm and fault."""
    entries = [{"id": f"f{k}", "faults": [fault]} for k, fault in enumerate(faults)]
    spec = {"id": "c", "replicates": 40, "scenarios": [{"use": "rogue.toml"}], "arms": arms, "faults": entries}
    return begin(parse_campaign(spec, "c"), campaign_file.parent, folder, Registry())


GOOD = {"kind": "dropout", "channel": "rogue/count"}


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ({"kind": "dropout", "channel": "rogue/cuont"}, "arm on, fault f1: .*did you mean 'rogue/count'"),
        ({"kind": "crash", "detector": "telemetri"}, "arm on, fault f1: .*did you mean 'telemetry'"),
        ({"kind": "ignored", "actions": ["hodl"]}, "arm on, fault f1: .*'hodl' matches no action"),
        (
            {"kind": "bias", "channel": "rogue/count", "fields": ["daat"], "magnitude": 1.0, "unit": ""},
            "arm on, fault f1: .*did you mean 'data'",
        ),
    ],
)
@pytest.mark.parametrize("workers", [1, 2])
def test_a_wrong_fault_ends_it_before_the_bulk(
    campaign_file: Path, tmp_path: Path, fault: dict[str, Any], said: str, workers: int
) -> None:
    found = begun(campaign_file, tmp_path / "out", [NONE, ON], GOOD, fault)
    estimates: list[Estimate] = []
    with pytest.raises(BadInputError, match=said):
        execute(found, workers, estimated=estimates.append)
    assert not estimates, "the bulk had begun"
    assert found.rows() == []
    begun(campaign_file, tmp_path / "out", [NONE, ON], GOOD)  # the folder is free


def test_a_wrong_channel_is_found_where_no_arm_judges(campaign_file: Path, tmp_path: Path) -> None:
    found = begun(campaign_file, tmp_path / "out", [NONE], {"kind": "dropout", "channel": "rogue/cuont"})
    with pytest.raises(BadInputError, match=r"arm none, fault f0: .*did you mean 'rogue/count'"):
        execute(found, 1)


def test_good_faults_cost_no_row_of_their_own(campaign_file: Path, tmp_path: Path) -> None:
    spec = {
        "id": "c",
        "scenarios": [{"use": "rogue.toml"}],
        "arms": [NONE, ON],
        "faults": [{"id": "f", "faults": [GOOD]}],
    }
    found = begin(parse_campaign(spec, "c"), campaign_file.parent, tmp_path / "out", Registry())
    assert execute(found, 2)
    assert [(r.arm, r.fault, r.status, r.end_s) for r in found.rows()] == [
        (arm, fault, "ok", 0.3) for fault in ("", "f") for arm in ("none", "on")
    ]


@pytest.mark.parametrize(
    ("config", "said"),
    [
        ({"risk": {"model": "correlated", "parameters": "nofile.toml"}}, "rogue, arm third: .*nofile.toml"),
        ({"risk": {"model": "correlated", "parameters": "table-4"}}, "rogue, arm third: .*did you mean 'table-3'"),
        ({"supervisor": {"taxonomy": "nofile.toml"}}, "rogue, arm third: .*nofile.toml"),
        ({"gates": {"modes": {"A99": {"caution": 0.5}}}}, "rogue, arm third: .*A99"),
        (
            {"policies": [{"use": "stl", "config": {"mode": "A9", "formula": "always(x <="}}]},
            "rogue, arm third: .*",
        ),
    ],
)
def test_a_wrong_configuration_of_any_arm_is_refused_before_anything_is_kept(
    campaign_file: Path, tmp_path: Path, config: dict[str, Any], said: str
) -> None:
    with pytest.raises(ConfigError, match=said):
        begun(campaign_file, tmp_path / "out", [NONE, ON, {"id": "third", "kind": "shadow", "config": config}])
    assert not (tmp_path / "out").exists()


def test_what_a_detector_of_a_later_arm_refuses_ends_it_before_the_bulk(campaign_file: Path, tmp_path: Path) -> None:
    detectors = [{"use": "balance", "config": {"urdf": "nofile.urdf"}}]
    found = begun(
        campaign_file, tmp_path / "out", [NONE, ON, {"id": "third", "kind": "on", "config": {"detectors": detectors}}]
    )
    with pytest.raises(BadInputError, match=f"rogue, arm third: .*{tmp_path / 'nofile.urdf'}"):
        execute(found, 1)


def test_files_of_an_arm_lie_beside_the_campaign(campaign_file: Path, tmp_path: Path) -> None:
    """Its scenario lies elsewhere, as those that come with Foreshock do."""
    text = campaign_file.with_name("rogue.toml").read_text()
    arms = [{**ON, "config": {"risk": {"model": "correlated", "parameters": "mine.toml"}}}]
    keys = []
    for name in ("here", "moved"):
        folder = tmp_path / name
        (folder / "scenarios").mkdir(parents=True)
        (folder / "scenarios" / "rogue.toml").write_text(text)
        (folder / "mine.toml").write_text(TABLE_3.read_text())
        spec = {"id": "c", "scenarios": [{"use": "scenarios/rogue.toml"}], "arms": arms}
        found = begin(parse_campaign(spec, "c"), folder, tmp_path / f"{name}-out", Registry())
        assert found.plan.identity["files"].keys() == {"rogue, on"}
        keys.append([c.key for c in found.plan.cases])
        assert execute(found, 1)
        assert [r.status for r in found.rows()] == ["ok"]
    assert keys[0] == keys[1], "content decides, not the place"
    (tmp_path / "moved" / "mine.toml").rename(tmp_path / "moved" / "scenarios" / "mine.toml")
    with pytest.raises(ConfigError, match=f"rogue, arm on: {tmp_path / 'moved' / 'mine.toml'}"):
        begin(parse_campaign(spec, "c"), tmp_path / "moved", tmp_path / "third", Registry())
