"""Names as people write them: 'Foot micro-slip' is the id 'foot-micro-slip'."""

from __future__ import annotations

from foreshock.errors import ConfigError
from foreshock.taxonomy import Taxonomy

__all__ = ["kind_of", "mode_of", "slug"]

_SPELLINGS = {"human-behavioral": "human-behavioural"}


def slug(name: str) -> str:
    """The name in lower case with hyphens, in British spelling."""
    joined = "-".join(name.lower().split())
    return _SPELLINGS.get(joined, joined)


def kind_of(name: str, taxonomy: Taxonomy) -> str:
    """The id of a precursor kind, from its id, an alias, or either in other case or with spaces.

    Raises:
        ConfigError: no such kind; the nearest is named.
    """
    try:
        return taxonomy.kind(name).id
    except ConfigError:
        return taxonomy.kind(slug(name)).id


def mode_of(name: str, taxonomy: Taxonomy) -> str:
    """The code of an accident mode, from its code or id, in any case.

    Raises:
        ConfigError: no such mode.
    """
    upper = name.strip().upper()
    return taxonomy.mode(upper if upper in taxonomy.codes else slug(name)).code
