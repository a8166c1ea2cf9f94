"""A campaign's file can be edited after it was begun: that is named, and with --accept the campaign is extended."""

from __future__ import annotations

from pathlib import Path

import pytest

from foreshock.campaign import load_campaign, reopen
from foreshock.registry import Registry
from tests.campaign.test_promises import foreshock, rows

ONE = "[[factors]]\nparameter = {parameter!r}\nvalues = [0.05]\n"


@pytest.fixture
def file(campaign_file: Path) -> Path:
    """Two seeds under three arms."""
    text = campaign_file.read_text().replace("replicates = 12", "replicates = 2")
    campaign_file.write_text(text[: text.index('[[arms]]\nid = "random"')])
    return campaign_file


def run(file: Path, out: Path) -> tuple[int, str]:
    return foreshock("run", file, "--out", out, "--workers", 1)


def edit(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def wall_s(folder: Path) -> dict[str, float | None]:
    """What tells whether a run was done again."""
    return {r.key: r.wall_s for r in reopen(folder, Registry())[0].rows()}


def test_more_replicates_are_named_and_then_run_beside_what_is_there(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run(file, out)[0] == 0
    before = wall_s(out)
    assert len(before) == 2 * 3
    edit(file, "replicates = 2", "replicates = 5")
    code, said = foreshock("resume", out, "--workers", 1)
    assert (code, "campaign.replicates was 2, is 5" in said) == (2, True), said
    assert "campaign.replicates was 2, is 5" in foreshock("status", out)[1]
    assert wall_s(out) == before
    code, said = foreshock("resume", out, "--accept", "--workers", 1)
    assert (code, "15 of 15 runs" in said) == (0, True), said
    after = wall_s(out)
    assert len(after) == 5 * 3
    assert after.items() > before.items()
    assert foreshock("resume", out, "--workers", 1)[0] == 0


def test_runs_that_are_no_part_of_it_any_more_are_counted_and_not_in_the_table(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run(file, out)[0] == 0
    before = wall_s(out)
    edit(file, "replicates = 2", "replicates = 1")
    code, said = foreshock("resume", out, "--accept", "--workers", 1)
    assert (code, "3 of 3 runs" in said) == (0, True), said
    assert "3 rows in the ledger are no longer part of it" in said
    assert len(rows(out)) == 3
    edit(file, "replicates = 1", "replicates = 2")
    assert foreshock("resume", out, "--accept", "--workers", 1)[0] == 0
    assert wall_s(out) == before, "they were still there"


def test_what_no_result_depends_on_may_change(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run(file, out)[0] == 0
    edit(file, "replicates = 2", 'replicates = 2\ntitle = "Another"\nmetrics = ["accidents"]')
    assert foreshock("resume", out, "--workers", 1)[0] == 0
    assert reopen(out, Registry())[0].plan.spec.metrics == ("accidents",)


def test_arms_and_factors_are_named_by_what_they_are(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    fault = '[[faults]]\nid = "f"\nfaults = [{ kind = "dropout", channel = "rogue/count" }]\n'
    file.write_text(file.read_text() + ONE.format(parameter="from") + fault)
    assert run(file, out)[0] == 0
    edit(file, '"rogue/count"', '"rogue/*"')
    edit(file, "[0.05]", "[0.05, 0.1]")
    edit(file, 'id = "shadow"\nkind = "shadow"', 'id = "other"\nkind = "shadow"')
    said = foreshock("resume", out, "--workers", 1)[1]
    for line in (
        "campaign.factors.from.values was [0.05], is [0.05, 0.1]",
        "campaign.arms.other is new",
        "campaign.arms.shadow is gone",
        "campaign.faults.f.faults.0.channel was rogue/count, is rogue/*",
    ):
        assert line in said
    edit(file, '"rogue/*"', '"rogue/count"')
    edit(file, "[0.05, 0.1]", "[0.05]")
    edit(file, '"other"\nkind = "shadow"', '"on"\nkind = "on"')
    on, shadow = ('[[arms]]\nid = "on"\nkind = "on"', '[[arms]]\nid = "shadow"\nkind = "shadow"')
    edit(file, f"{on}\n\n{on}", f"{on}\n\n{shadow}")
    assert "campaign.arms are in another order" in foreshock("resume", out, "--workers", 1)[1]


def test_bad_input_before_the_first_row_leaves_nothing_in_the_way(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    file.write_text(file.read_text() + ONE.format(parameter="form"))
    code, said = run(file, out)
    assert (code, "did you mean 'from'" in said) == (2, True), said
    edit(file, "'form'", "'from'")
    code, said = run(file, out)
    assert (code, "6 of 6 runs" in said) == (0, True), said


def test_bad_input_after_the_first_row_can_be_repaired(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run(file, out)[0] == 0
    before = wall_s(out)
    good = file.read_text()
    (tmp_path / "other.toml").write_text((tmp_path / "rogue.toml").read_text().replace('id = "rogue"', 'id = "other"'))
    more = '[[scenarios]]\nuse = "other.toml"\n'
    file.write_text(good + more + ONE.format(parameter="form") + 'scenarios = ["other"]\n')
    code, said = foreshock("resume", out, "--accept", "--workers", 1)
    assert (code, "did you mean 'from'" in said) == (2, True), said
    edit(file, "'form'", "'from'")
    code, said = foreshock("resume", out, "--workers", 1)
    assert (code, "campaign.factors.form is gone" in said) == (2, True), said
    code, said = foreshock("resume", out, "--accept", "--workers", 1)
    assert (code, "12 of 12 runs" in said) == (0, True), said
    assert wall_s(out).items() > before.items()


def test_another_expectation_of_a_scenario_is_named_and_costs_no_run(file: Path, tmp_path: Path) -> None:
    """Whether a scenario counts as harmless decides what its runs count as."""
    out = tmp_path / "out"
    assert run(file, out)[0] == 0
    before = wall_s(out)
    edit(tmp_path / "rogue.toml", 'expect = "open"', 'expect = "none"')
    line = "scenarios.rogue.expect was open, is none"
    assert line in foreshock("status", out)[1]
    code, said = foreshock("resume", out)
    assert (code, line in said) == (2, True), said
    assert foreshock("resume", out, "--accept")[0] == 0
    assert wall_s(out) == before
    assert line not in foreshock("status", out)[1]


def test_a_budget_of_wall_time_that_is_used_up_is_no_success(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    file.write_text(file.read_text() + "[budget]\nhours = 1e-9\n")
    code, said = run(file, out)
    assert code == 1, said
    assert f"the budget of 1e-09 h is used up after 0 of 6 runs; go on with: foreshock campaign resume {out}" in said
    assert foreshock("resume", out, "--workers", 1)[0] == 1
    edit(file, "hours = 1e-9", "hours = 1.0")
    assert foreshock("resume", out, "--workers", 1)[0] == 0


def test_metrics_that_need_a_reference_arm_are_said_to_be_missing(file: Path, tmp_path: Path) -> None:
    text = file.read_text().replace("replicates = 2", 'replicates = 1\nmetrics = ["accidents", "false-interventions"]')
    arms = text.split("[[arms]]")
    file.write_text(arms[0] + "[[arms]]" + arms[3])
    code, said = run(file, tmp_path / "out")
    assert (code, "there is no reference arm (kind none or shadow): no false-interventions" in said) == (0, True), said
    assert "no reference arm" in foreshock("resume", tmp_path / "out")[1]
    file.write_text(arms[0] + "[[arms]]" + arms[1] + "[[arms]]" + arms[3])
    code, said = run(file, tmp_path / "two")
    assert (code, "no reference arm" in said) == (0, False), said


def test_a_file_that_is_gone_or_cannot_be_read(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run(file, out)[0] == 0
    text = file.read_text()
    file.write_text(text.replace("replicates", "replicas"))
    for words in (("resume", out), ("resume", out, "--accept")):
        code, said = foreshock(*words)
        assert (code, "did you mean 'replicates'" in said) == (2, True), said
    assert "did you mean 'replicates'" in foreshock("status", out)[1]
    file.unlink()
    for command in ("resume", "status"):
        code, said = foreshock(command, out)
        assert (code, f"{file} is gone" in said, "6 of 6 runs" in said) == (0, True, True), said


def test_a_stored_campaign_that_cannot_be_planned_any_more_is_no_dead_end(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run(file, out)[0] == 0
    before = wall_s(out)
    (tmp_path / "rogue.toml").rename(tmp_path / "moved.toml")
    edit(file, "rogue.toml", "moved.toml")
    code, said = foreshock("resume", out)
    assert (code, "campaign.scenarios.rogue.toml is gone" in said, "--accept" in said) == (2, True, True), said
    assert foreshock("resume", out, "--accept")[0] == 0
    assert wall_s(out) == before, "the scenario is the same"
    assert load_campaign(str(file))[0].scenarios[0].use == "moved.toml"
