"""Every arm of a report can be told from every other."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import msgspec
import numpy as np

from foreshock.campaign import Campaign, Row, load_campaign, parse_campaign, plan_of, shipped
from foreshock.campaign.looks import looks_of
from foreshock.campaign.page import write_page
from foreshock.campaign.ranking import duels_of, standings_of
from foreshock.campaign.results import results_of
from foreshock.campaign.trace import traces_of
from foreshock.registry import Registry

ARMS = [
    {"id": "none", "kind": "none"},
    {"id": "shadow", "kind": "shadow"},
    {"id": "shadow-correlated", "kind": "shadow", "config": {"risk": {"model": "correlated", "parameters": "table-3"}}},
    *({"id": f"c-{k}", "kind": "on", "config": {"risk": {"c": 1.0 + 0.05 * k}}} for k in range(10)),
    {"id": "random", "kind": "random"},
    {"id": "always", "kind": "always"},
]
SPEC = {
    "id": "many-arms",
    "title": "Fifteen arms",
    "replicates": 8,
    "scenarios": [
        {"use": id_ + tail} for id_ in ("a1-fall-onto-human", "a2-arm-torso-strike") for tail in ("", "-nominal")
    ],
    "arms": ARMS,
}


def test_looks_differ_up_to_forty_arms() -> None:
    for spec in (load_campaign(id_)[0] for id_ in shipped()):
        looks = looks_of(a.id for a in spec.arms)
        assert len(set(looks.values())) == len(spec.arms)
    looks = list(looks_of(str(k) for k in range(40)).values())
    assert len(set(looks)) == 40
    for a, b in itertools.pairwise(looks):
        assert a.colour != b.colour
        assert a.marker != b.marker


def page_of(folder: Path) -> Path:
    """A report of fifteen arms, of runs drawn at random: the better the later the arm."""
    plan, rng, rows = plan_of(parse_campaign(SPEC, "c"), Path(), Registry()), np.random.default_rng(1), []
    place = {a["id"]: k for k, a in enumerate(ARMS)}
    columns = ("key", "scenario", "mode", "arm", "point", "replicate", "seed", "parameters", "fault")
    for case in plan.cases:
        k, harmless = place[case.arm], case.scenario.endswith("-nominal")
        fell = not harmless and bool(rng.random() < (0.95 if k < 3 else 0.8 - 0.06 * k))
        acted = k > 0 and bool(rng.random() < (0.04 * k if harmless else 0.9))
        at_s = float(4.0 + rng.random()) if fell else None
        row = Row(**{c: getattr(case, c) for c in columns}, accident=fell, outcome="fall" if fell else "none", level=0)
        changes = {"accident_s": at_s, "event_s": at_s, "end_s": 12.0, "reduced_s": 4.0 if acted else 0.0}
        if acted:
            changes |= {"protective_s": float(1.0 + 3.0 * rng.random()), "safe_s": 6.0}
            changes["acted_s"] = changes["protective_s"]
        if case.arm.startswith("shadow"):
            changes["peak_p"] = float(np.clip(rng.normal(0.7 if fell else 0.3, 0.2), 0.0, 1.0))
        rows.append(msgspec.structs.replace(row, **changes))
    results = results_of(plan, rows)
    ranking = standings_of(plan, results), duels_of(plan, rows)
    page = folder / "report.html"
    write_page(page, Campaign(folder, plan), rows, results, traces_of(plan, rows, results), ranking)
    return page


def test_fifteen_arms_of_a_report_can_be_told_apart(tmp_path: Path) -> None:
    text = page_of(tmp_path).read_text()
    drawn = re.findall(
        r'<svg class="key".*?<path class="mark"[^>]* d="([^"]+)" fill="([^"]+)"/></svg>([a-z0-9-]+)', text
    )
    arms = {arm: (marker, colour) for marker, colour, arm in drawn}
    assert set(arms) == {a["id"] for a in ARMS}
    assert len(set(arms.values())) == len(ARMS)
