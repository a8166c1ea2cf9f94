"""One run of a campaign, done again in full detail and held against its row."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec

from foreshock.campaign.engine import Campaign
from foreshock.campaign.ledger import Ledger, Row, row_of
from foreshock.campaign.plan import Case
from foreshock.errors import BadInputError
from foreshock.session.isolated import Failure, run_all
from foreshock.session.run import Run

__all__ = ["Again", "case_of", "rerun"]


class Again(msgspec.Struct, frozen=True):
    """A run that was done again.

    Attributes:
        case: which.
        result: what it came to.
        differs: columns of its row that differ from the ledger's; empty if it is the same.
        known: whether the ledger has a row of it.
    """

    case: Case
    result: Run | Failure
    differs: dict[str, tuple[object, object]]
    known: bool


def case_of(campaign: Campaign, key: str, changed: Sequence[str] = ()) -> Case:
    """The run whose key begins so.

    Args:
        campaign: that it belongs to.
        key: the beginning of its key.
        changed: what has changed since the campaign was begun: keys with it.

    Raises:
        BadInputError: there is none, or more than one.
    """
    found = [c for c in campaign.plan.cases if c.key.startswith(key)]
    if len(found) != 1:
        what = "several runs begin" if found else "no run of the campaign begins"
        hint = "".join(f"\nchanged since it was begun: {line}" for line in changed)
        raise BadInputError("KEY", f"{what} with {key!r}", hint)
    return found[0]


def rerun(campaign: Campaign, case: Case, journal: Path | None = None) -> Again:
    """Do a run again.

    Args:
        campaign: that it belongs to.
        case: the run.
        journal: file to record it in.

    Raises:
        BadInputError: it takes the interventions of a run that is not there.
    """
    with Ledger(campaign.folder) as ledger:
        statuses = ledger.statuses()
        if case.source and statuses.get(case.source) != "ok":
            raise BadInputError(case.key, f"run {case.source}, whose interventions it takes, has no result")
        job = campaign.plan.job(case, ledger.changes(case.source) if case.source else ())
        before = ledger.rows([case])
    job = msgspec.structs.replace(job, detail=True, journal="" if journal is None else str(journal.resolve()))
    (result,) = run_all([job], 1, campaign.plan.spec.timeout_s)
    row = row_of(case, result, 0.0, job.scripted)
    return Again(case, result, _differences(before[0], row) if before else {}, bool(before))


def _differences(before: Row, now: Row) -> dict[str, tuple[object, object]]:
    pairs = {f: (getattr(before, f), getattr(now, f)) for f in Row.__struct_fields__ if f not in ("wall_s", "log")}
    return {f: pair for f, pair in pairs.items() if pair[0] != pair[1]}
