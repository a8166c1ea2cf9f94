"""Tables of whole-body.md.

python docs/results/whole_body.py nominal
python docs/results/whole_body.py out/whole-body out/whole-body-subsets
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from msgspec.structs import replace

from foreshock.campaign.engine import Campaign, reopen
from foreshock.campaign.ledger import Row
from foreshock.campaign.results import ArmResult, results_of
from foreshock.records import Decision
from foreshock.registry import Registry
from foreshock.session.isolated import build_twin
from foreshock.session.rates import wilson
from foreshock.session.scenario import find_scenario
from foreshock.session.simulate import simulate
from foreshock.supervisor import Supervisor

PROTOCOLS = {
    "s": "step-suppression",
    "a": "arm-reconfiguration",
    "c": "compliance-tuning",
    "b": "balance-lock",
}
KINDS = ("foot-micro-slip", "torso-angular-spike", "com-lateral-deviation", "sway-amplitude-increase")
SEED = 60000
Seat = tuple[str, int]


def seat(row: Row) -> Seat:
    """What the arms of both campaigns share."""
    return row.scenario, row.seed


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table in Markdown."""
    print("\n| " + " | ".join(head) + " |")
    print("|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(row) + " |")


def short(scenario: str) -> str:
    """Without the twin."""
    return scenario.partition("@")[0]


def effect(results: Sequence[ArmResult], calm: Collection[str]) -> None:
    """Accidents by scenario and arm, paired with the runs in shadow; calm are scenarios without an accident."""
    rows = []
    for r in results:
        if r.scope.kind not in ("overall", "scenario", "mode"):
            continue
        if r.scope.name in calm and not (r.accidents.k or r.harmed or (r.false and r.false.k)):
            continue
        d, lead = r.difference, r.lead_quartiles_s
        rows.append(
            (
                short(r.scope.name) or "all",
                r.arm,
                str(r.accidents),
                f"{100 * d.difference:+.0f} ({100 * d.low:+.0f}..{100 * d.high:+.0f}), p {d.p:.2g}" if d else "–",
                f"{r.prevented.k}/{r.prevented.n}" if d else "–",
                str(r.caused) if d else "–",
                " / ".join(f"{x:.2f}" for x in lead) if lead and d else "–",
                "–" if r.false is None else f"{r.false.k} in {60.0 * r.false.hours:.1f} min",
            )
        )
    head = ("part", "arm", "accidents", "paired difference (points)", "prevented", "caused", "lead, quartiles (s)")
    table((*head, "false interventions"), rows)


def by_subset(rows: Sequence[Row]) -> dict[str, dict[Seat, bool]]:
    """Accidents by arm and seat."""
    found: dict[str, dict[Seat, bool]] = {}
    for row in rows:
        if row.accident is not None:
            found.setdefault(row.arm, {})[seat(row)] = row.accident
    return found


def subsets(rows: Sequence[Row], arms: Sequence[str]) -> None:
    """Prevented of the unsupervised falls, and falls that only the arm has, by subset and scenario."""
    found = by_subset(rows)
    base = found["shadow"]
    scenarios = list(dict.fromkeys(s for s, _ in base))

    def cell(arm: str, scenario: str) -> str:
        pairs = [(base[s], hurt) for s, hurt in found[arm].items() if s in base and scenario in ("", s[0])]
        fell = [hurt for was, hurt in pairs if was]
        caused = sum(hurt for was, hurt in pairs if not was)
        return f"{len(fell) - sum(fell)}/{len(fell)}" + (f", {caused} caused" if caused else "")

    body = [(arm, *(cell(arm, s) for s in scenarios), cell(arm, "")) for arm in arms if arm in found]
    table(("actions", *(short(s).removeprefix("a1-fall-") for s in scenarios), "all"), body)


def savable(rows: Sequence[Row], arms: Sequence[str], judged: Sequence[str]) -> None:
    """Of the falls that some subset prevents, the share that each judged arm prevents."""
    found = by_subset(rows)
    fell = [s for s, hurt in found["shadow"].items() if hurt]
    can = [s for s in fell if any(not found[a].get(s, True) for a in arms if a in found)]
    print(f"\nOf {len(fell)} falls in shadow, some subset prevents {len(can)}.")
    for arm in judged:
        print(f"- {arm} prevents {wilson(sum(not found[arm][s] for s in can), len(can))} of these")


def of(folder: str) -> tuple[Campaign, list[Row]]:
    """A campaign and its rows."""
    campaign, _ = reopen(Path(folder), Registry())
    return campaign, campaign.rows()


def nominal() -> None:
    """60 s of standing and of walking, supervised: interventions, and the largest statistics."""
    registry = Registry()
    walks = [{"step_length": x} for x in (0.0, 0.1, 0.2)]
    cases = [("nominal-standing", {}), *(("nominal", walk) for walk in walks)]
    rows = []
    for suffix, values in cases:
        scenario = find_scenario(f"a1-fall-onto-human-{suffix}", registry, "mujoco").with_(values)
        scenario = replace(scenario, duration_s=60.0)
        with tempfile.TemporaryDirectory() as scratch:
            twin = build_twin(scenario, registry, Path(scratch))
            supervisor = Supervisor(scenario.supervisor(), Path(scenario.folder), registry)
            largest = Largest()
            run = simulate(scenario, twin, supervisor, "on", SEED, detail=False, journals=[largest])
            supervisor.close()
            twin.close()
        what = "standing" if not values else f"walking, {100 * values['step_length']:g} cm a step"
        seen = (f"{largest.share[k]:.2f}" for k in KINDS)
        rows.append((what, str(len(run.interventions)), str(len(run.first_s)), str(len(run.events)), *seen))
        print(rows[-1], file=sys.stderr, flush=True)
    table(("60 s of", "interventions", "precursors", "events", *KINDS), rows)


class Largest:
    """A journal that keeps the largest statistic of each kind, as a share of its threshold."""

    def __init__(self) -> None:
        self.share = dict.fromkeys(KINDS, 0.0)

    def tick(self, samples: object, decision: Decision, verdicts: object) -> None:  # noqa: ARG002 # the port's
        """Take one tick."""
        for i in decision.indications:
            if i.kind in self.share:
                self.share[i.kind] = max(self.share[i.kind], i.statistic / i.threshold)


def count(rows: Sequence[Row]) -> str:
    """How many runs, and how many gave no result."""
    return f"{len(rows)} runs, {sum(not r.ok for r in rows)} without a result"


def main(main_folder: str, subset_folder: str) -> None:
    """Print all tables."""
    campaign, rows = of(main_folder)
    print(f"{count(rows)}, seeds from {campaign.plan.spec.seed}")
    calm = {id_ for id_, s in campaign.plan.scenarios.items() if s.expect == "none"}
    effect(results_of(campaign.plan, rows), calm)
    print(f"\nNo line: {len(calm)} scenarios without an accident, in which the arm did nothing and nothing happened.")
    campaign, some = of(subset_folder)
    print(f"\n{count(some)}; shadow, by-cause and protocol from the runs above with the same seeds")
    print("\n" + ", ".join(f"{k} {v}" for k, v in PROTOCOLS.items()))
    seats = {seat(r) for r in some}
    joined = [*some, *(r for r in rows if seat(r) in seats)]
    arms = [a.id for a in campaign.plan.spec.arms]
    subsets(joined, [*arms, "by-cause", "protocol"])
    savable(joined, arms, ("by-cause", "protocol"))


if __name__ == "__main__":
    if sys.argv[1:] == ["nominal"]:
        nominal()
    else:
        main(*sys.argv[1:])
