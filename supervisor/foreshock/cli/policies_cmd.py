"""``foreshock policies``: what intervenes, and the check that worse evidence never lowers the protection level."""

from __future__ import annotations

import math

import click
import msgspec
from rich.progress import Progress

from foreshock.cli.output import NEGATIVE, OK, console, emit, left_out, notes, table
from foreshock.config import PolicyEntry
from foreshock.policy import ACTIONS
from foreshock.registry import Registry
from foreshock.session.ladder import PHASES, TIMES_S, Broken, Cell, KindState, check_ladder
from foreshock.taxonomy import builtin_taxonomy

__all__ = ["policies"]

STATES_PER_MODE = (2 * len(PHASES)) ** 3 * len(TIMES_S)


@click.group()
def policies() -> None:
    """Intervention policies: list them and their actions, check that they never relent."""


@policies.command("list")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def list_(as_json: bool) -> None:
    """List the installed policies, and every action with its duration and what it may make worse."""
    registry = Registry()
    left_out(registry.load_all())
    found = registry.policies()
    actions = {**ACTIONS, **{a.id: a for p in found for a in p.actions}}
    if as_json:
        emit({"policies": [{"id": p.id, "summary": p.summary} for p in found], "actions": list(actions.values())})
        return
    table("Policies", "id", "what", rows=[(p.id, p.summary) for p in found])
    rows = [
        (a.id, a.title, ", ".join(a.resources), f"{a.duration_s:g}", "\n".join(a.may_worsen), a.source)
        for a in actions.values()
    ]
    columns = ("action", "what", "takes hold of", "s", "may worsen", "source")
    table("Actions; s until they help", *columns, rows=rows, right=("s",))


@policies.command()
@click.argument("mode", nargs=-1)
@click.option("--policy", default="protocol", show_default=True, help="Policy to run; it must take a mode.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def check(mode: tuple[str, ...], policy: str, as_json: bool) -> int:
    """Check every state of evidence of accident MODEs (all by default): phase, observed or not, time to the accident.

    Exit code 1 if worse evidence gives a lower protection level anywhere.
    """
    taxonomy = builtin_taxonomy()
    codes = [taxonomy.mode(m, "MODE").code for m in mode] or list(taxonomy.codes)
    results: dict[str, tuple[list[Cell], list[Broken]]] = {}
    with Progress(console=notes, transient=True, disable=as_json) as bar:
        task = bar.add_task("states", total=STATES_PER_MODE * len(codes))
        for code in codes:
            entry = PolicyEntry(policy, {"mode": code})
            results[code] = check_ladder(code, [entry], done=lambda: bar.update(task, advance=1))
    broken = {code: found for code, (_, found) in results.items()}
    if as_json:
        emit(
            [
                {"mode": c, "states": len(cells), "broken": broken[c], "table": cells}
                for c, (cells, _) in results.items()
            ]
        )
    else:
        for code, (cells, _) in results.items():
            _print(code, cells)
        for code, found in broken.items():
            states = len(results[code][0])
            console.print(f"{code}: {states} states, {len(found)} pairs in which worse evidence lowers the level")
    return NEGATIVE if any(broken.values()) else OK


def _print(code: str, cells: list[Cell]) -> None:
    """The states that a cascade goes through; all states are in the JSON."""
    kinds = builtin_taxonomy().mode(code).cascade
    at = {(c.states, c.time_s): c for c in cells}
    absent, onset = KindState(0, False), KindState(list(PHASES).index("onset"), False)
    rows = []
    for n in range(len(kinds) + 1):
        for lost in (False, True):
            states = tuple(msgspec.structs.replace(onset if i < n else absent, lost=lost) for i in range(len(kinds)))
            cell = at[states, math.inf]
            what = "nothing" if n == 0 else "+".join(str(i + 1) for i in range(n))
            actions = [" ".join(at[states, t].actions) for t in TIMES_S]
            same = [a if i == 0 or a != actions[i - 1] else "″" for i, a in enumerate(actions)]
            level = max(cell.level, cell.overall).name.lower().replace("_", "-")
            rows.append((what + (", lost" if lost else ""), f"{cell.trust:.2f}", level, *same))
    times = tuple("no prediction" if math.isinf(t) else f"{t:g} s left" for t in TIMES_S)
    named = ", ".join(f"{i + 1} {k}" for i, k in enumerate(kinds))
    table(f"{code}: {named}", "precursors", "trust", "level", *times, rows=rows, right=("trust",))
