"""What docs/campaigns.md promises of a campaign, from outside: the commands, their exit codes and the Parquet table."""

from __future__ import annotations

import contextlib
import io
import shutil
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from foreshock.cli import main
from tests.campaign.conftest import ROGUE, SCENARIO

SPEC = """
id = "promises"
replicates = 3
seed = 11
timeout_s = 20.0

{scenarios}

[[factors]]
parameter = "from"
values = [0.05, 0.1]

{arms}
"""
ARMS = {kind: f'[[arms]]\nid = "{kind}"\nkind = "{kind}"\n' for kind in ("none", "shadow", "on", "random", "always")}


def foreshock(*words: object) -> tuple[int, str]:
    """Exit code, and what was said to people."""
    said = io.StringIO()
    with pytest.raises(SystemExit) as end, contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        main(["campaign", *(str(w) for w in words)])
    assert isinstance(end.value.code, int)
    return end.value.code, " ".join(said.getvalue().split())


def rows(folder: Path) -> dict[str, dict[str, object]]:
    """The Parquet table by key, without what says how long a run took."""
    assert foreshock("report", folder)[0] == 0
    table = pq.read_table(folder / "runs.parquet").to_pylist()
    return {str(r["key"]): {k: v for k, v in r.items() if k != "wall_s"} for r in table}


def spec(folder: Path, scenarios: list[str], arms: list[str], more: str = "") -> Path:
    folder.mkdir(exist_ok=True)
    shutil.copytree(ROGUE, folder / "rogue", dirs_exist_ok=True)
    for name in scenarios:
        text = SCENARIO.replace('id = "rogue"', f'id = "{name}"').replace(str(ROGUE), "./rogue")
        (folder / f"{name}.toml").write_text(text)
    used = "\n".join(f'[[scenarios]]\nuse = "{name}.toml"' for name in scenarios)
    file = folder / "spec.toml"
    file.write_text(more + SPEC.format(scenarios=used, arms="\n".join(ARMS[a] for a in arms)))
    return file


def test_neither_workers_nor_order_change_a_result(tmp_path: Path) -> None:
    forward = spec(tmp_path / "f", ["one", "two"], ["none", "shadow", "on", "random", "always"])
    backward = spec(tmp_path / "b", ["two", "one"], ["always", "on", "none", "random", "shadow"])
    assert foreshock("run", forward, "--out", tmp_path / "w1", "--workers", 1)[0] == 0
    assert foreshock("run", forward, "--out", tmp_path / "w3", "--workers", 3)[0] == 0
    assert foreshock("run", backward, "--out", tmp_path / "back", "--workers", 2)[0] == 0
    one, three, back = (rows(tmp_path / name) for name in ("w1", "w3", "back"))
    assert len(one) == 2 * 2 * 3 * 5
    assert three == one

    def by_what(table: dict[str, dict[str, object]]) -> dict[tuple[object, ...], dict[str, object]]:
        # a key may cover paths, and the two campaigns lie in folders of their own
        own = ("key", "source", "point")
        return {
            (r["scenario"], r["seed"], r["arm"], r["parameter.from"]): {k: v for k, v in r.items() if k not in own}
            for r in table.values()
        }

    assert by_what(back) == by_what(one)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (("one.toml", "duration_s = 0.3", "duration_s = 0.4"), "one.duration_s"),
        (("rogue/rogue.c", "self->count += 1.0;", "self->count += 2.0;"), "one"),
        (("rogue/binding.toml", "period_s = 0.001", "period_s = 0.002"), "one"),
        (("one.toml", "period_s = 0.001", "period_s = 0.002"), "one.config.supervisor.period_s"),
    ],
)
def test_a_resume_with_another_key_names_what_changed(tmp_path: Path, change: tuple[str, str, str], named: str) -> None:
    file = spec(tmp_path / "c", ["one"], ["none", "shadow"])
    out = tmp_path / "out"
    assert foreshock("run", file, "--out", out, "--workers", 1)[0] == 0
    before = rows(out)
    name, old, new = change
    text = (tmp_path / "c" / name).read_text()
    assert old in text
    (tmp_path / "c" / name).write_text(text.replace(old, new))
    code, said = foreshock("resume", out, "--workers", 1)
    assert code == 2
    assert named in said
    assert rows(out) == before
    code, said = foreshock("resume", out, "--accept", "--workers", 1)
    assert code == 0, said
    assert len(rows(out)) == len(before)
    assert rows(out).keys() != before.keys()


def test_what_does_not_depend_on_a_change_is_kept(tmp_path: Path) -> None:
    file = spec(tmp_path / "c", ["one", "two"], ["none", "shadow"])
    out = tmp_path / "out"
    assert foreshock("run", file, "--out", out, "--workers", 1)[0] == 0
    before = rows(out)
    scenario = tmp_path / "c" / "two.toml"
    scenario.write_text(scenario.read_text().replace("duration_s = 0.3", "duration_s = 0.2"))
    assert foreshock("resume", out, "--accept", "--workers", 1)[0] == 0
    after = rows(out)
    assert {k for k, r in before.items() if r["scenario"] == "one"} == before.keys() & after.keys()
    assert len(after) == len(before)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('kind = "shadow"', 'kind = "shaddow"', ["arms", "shaddow", "shadow"]),
        ("replicates = 3", "replicas = 3", ["replicas", "replicates"]),
        ("seed = 11", "seed = -1", ["seed", "-1"]),
        ('use = "one.toml"', 'use = "won.toml"', ["won.toml", "one.toml"]),
        ('parameter = "from"', 'parameter = "form"', ["form", "'from'"]),
        ("values = [0.05, 0.1]", "values = [0.05, nan]", ["factors.from", "nan"]),
        ("values = [0.05, 0.1]", "uniforn = [0.05, 0.1]", ["uniforn", "uniform"]),
        ("values = [0.05, 0.1]", "values = [0.05]\nscenarios = ['onee']", ["factors.from", "onee", "'one'"]),
        ('id = "shadow"', 'id = "shadow"\nscenarios = ["onee"]', ["arms.shadow", "onee", "'one'"]),
        ('id = "shadow"', 'id = "shadow"\npolicy = "protocoll"', ["protocoll", "'protocol'"]),
        (
            'id = "shadow"',
            'id = "shadow"\nconfig.detectors = [{ use = "telemtry" }]',
            ["telemtry", "'telemetry'"],
        ),
        ("timeout_s = 20.0", "timeout_s = 0.0", ["timeout_s", "0.0"]),
        ("timeout_s = 20.0", 'timeout_s = 20.0\nmetrics = ["lead_time"]', ["metrics", "lead_time", "lead-time"]),
        ("timeout_s = 20.0", 'timeout_s = 20.0\nreference = "shadwo"', ["reference", "shadwo", "'shadow'"]),
    ],
)
def test_a_bad_spec_names_place_value_and_the_nearest_name(tmp_path: Path, old: str, new: str, said: list[str]) -> None:
    file = spec(tmp_path / "c", ["one"], ["none", "shadow"])
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    code, told = foreshock("run", file, "--out", tmp_path / "out", "--workers", 1)
    assert code == 2, told
    for word in said:
        assert word in told
