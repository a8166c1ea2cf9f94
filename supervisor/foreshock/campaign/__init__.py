"""Co-simulation test campaigns: scenarios, factors and arms on paired seeds, durable, resumable, with statistics."""

from foreshock.campaign.engine import Campaign, Estimate, Progress, begin, execute, reopen
from foreshock.campaign.ledger import Row
from foreshock.campaign.plan import Case, Plan, plan_of
from foreshock.campaign.spec import CampaignSpec, campaign_schema, load_campaign, parse_campaign, shipped

__all__ = [
    "Campaign",
    "CampaignSpec",
    "Case",
    "Estimate",
    "Plan",
    "Progress",
    "Row",
    "begin",
    "campaign_schema",
    "execute",
    "load_campaign",
    "parse_campaign",
    "plan_of",
    "reopen",
    "shipped",
]
