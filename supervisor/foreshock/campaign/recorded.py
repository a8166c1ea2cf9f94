"""A campaign as its ledger has it, whatever has become of scenarios, plants and code since then."""

from __future__ import annotations

from pathlib import Path

import msgspec

from foreshock.campaign.engine import Campaign, reopen
from foreshock.campaign.ledger import Ledger
from foreshock.campaign.plan import Case, Plan
from foreshock.campaign.spec import CampaignSpec
from foreshock.errors import BadInputError
from foreshock.registry import Registry
from foreshock.session.scenario import Scenario

__all__ = ["recorded"]


def recorded(folder: Path, registry: Registry) -> tuple[Campaign, list[str]]:
    """What was run, to be reported and compared; and what has changed since it was begun, or why nobody can say.

    Ledgers from before scenarios and runs were kept need what there is now, unchanged or not.

    Args:
        folder: of the campaign.
        registry: of plugins.

    Raises:
        BadInputError: there is no campaign, or it is such a ledger and something it needs is gone.
    """
    with Ledger(folder) as ledger:
        spec, identity = ledger.meta("spec", CampaignSpec), ledger.meta("identity", dict)
        scenarios = ledger.known("scenarios", dict[str, Scenario])
        cases = ledger.known("cases", tuple[Case, ...])
    try:
        now, found = reopen(folder, registry)
    except BadInputError as e:
        if scenarios is None or cases is None:
            raise
        return Campaign(folder, Plan(spec, scenarios, identity, cases)), [f"what there is now cannot be compared: {e}"]
    if scenarios is None or cases is None:
        return msgspec.structs.replace(now, plan=msgspec.structs.replace(now.plan, identity=identity)), found
    return Campaign(folder, Plan(now.plan.spec, scenarios, identity, cases), now.note), found
