"""A synthetic set of events with the paper's published marginals; nobody observed any of them.

From the paper: mode counts (Table 1, exact at n = 126), 241 precursors in all, class shares (section 3.2.2, as near
as integers allow), 73 % of the accidents with two precursors within 1.5 s, classes of modes (Table 2) and cascades
with their order (Table 3) as preferences, nine tasks, five platforms, two coders with kappa 0.86 for precursors.
Invented: everything else, such as which events have which precursors, how strong the preferences are, all times and
ends, environments, relations, disagreement on outcomes, near misses.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foreshock.errors import BadInputError
from foreshock.events import _draw
from foreshock.events._second_coder import recoded
from foreshock.events._template import ENVIRONMENTS, PLATFORMS, deviation_of, relation_of, tasks_of
from foreshock.events.schema import NO_ACCIDENT, SYNTHETIC, Event, EventPrecursor
from foreshock.taxonomy import Taxonomy, builtin_taxonomy

__all__ = ["EVENTS", "KAPPA", "OVERLAP", "PRECURSORS", "synthetic_events"]

EVENTS, PRECURSORS, OVERLAP, KAPPA = 126, 241, 0.73, 0.86
"""Documented events, their precursors, share with overlapping ones, agreement of the coders (sections 3.1, 3.2.2)."""

WINDOW_S = 1.5
IN_ORDER = 0.85
"""Probability that the kinds of a mode's cascade are put in Table 3's order; else they are shuffled."""


def synthetic_events(
    seed: int,
    n: int = EVENTS,
    coders: Sequence[str] = ("coder-1", "coder-2"),
    *,
    near_misses: int = 0,
    kappa: float = KAPPA,
    taxonomy: Taxonomy | None = None,
) -> list[Event]:
    """Synthetic events, all rows of the first coder first; ids begin with ``synthetic-``, the source is ``synthetic``.

    Args:
        seed: of the draw; equal arguments give equal events.
        n: number of accidents.
        coders: the first one's rows have the marginals; each other agrees with the first to kappa.
        near_misses: further events without an accident, with at most two precursors; invented altogether.
        kappa: agreement on precursors and on outcomes, 0..1.
        taxonomy: the paper's, by default.

    Raises:
        BadInputError: n or near_misses is negative, no coder or one twice, or kappa is not within 0..1.
    """
    if n < 0 or near_misses < 0:
        raise BadInputError("synthetic events", f"{min(n, near_misses)} events cannot be drawn")
    if not coders or len(set(coders)) < len(coders) or not all(coders):
        raise BadInputError("synthetic events", f"coders {list(coders)!r} are not distinct names")
    if not 0.0 <= kappa <= 1.0:
        raise BadInputError("synthetic events", f"kappa {kappa!r} is not within 0..1")
    full = taxonomy or builtin_taxonomy()
    rng = np.random.default_rng(seed)
    modes = [
        str(code) for code in rng.permutation(np.repeat(full.codes, _draw.apportion([m.n for m in full.modes], n)))
    ]
    sizes = list(_draw.sizes(n, round(PRECURSORS * n / EVENTS), round(OVERLAP * n), rng))
    sizes += list(rng.choice([0, 1, 2], near_misses, p=[0.4, 0.5, 0.1]))
    accidents = _draw.classes([m for m, k in zip(modes, sizes, strict=False) for _ in range(k)], full, rng)
    shares = np.array([c.share for c in full.classes])
    others = rng.choice([c.id for c in full.classes], sum(sizes[n:]), p=shares / shares.sum())
    slots = iter([*accidents, *(str(c) for c in others)])
    first = [
        _event(k, mode, [next(slots) for _ in range(size)], coders[0], full, rng)
        for k, (mode, size) in enumerate(zip([*modes, *[NO_ACCIDENT] * near_misses], sizes, strict=True), 1)
    ]
    return [*first, *(e for coder in coders[1:] for e in recoded(first, coder, kappa, full, rng))]


def _event(k: int, mode: str, classes: list[str], coder: str, taxonomy: Taxonomy, rng: np.random.Generator) -> Event:
    kinds = _ordered(mode, _draw.kinds(mode, classes, taxonomy, rng), taxonomy, rng)
    start = round(float(rng.uniform(0.3, 2.0)), 2)
    gaps = np.clip(rng.lognormal(np.log(0.55), 0.5, max(0, len(kinds) - 1)), 0.05, WINDOW_S - 0.05)
    onsets = [round(start + float(g), 2) for g in (0.0, *np.cumsum(gaps))]
    lead = round(float(np.clip(rng.lognormal(np.log(0.5), 0.5), 0.1, 2.0)), 2)
    until = round(onsets[-1] + lead, 2)
    precursors = tuple(EventPrecursor(kind, t, _end(t, until, rng)) for kind, t in zip(kinds, onsets, strict=False))
    task = str(rng.choice(tasks_of(mode)))
    accident = mode != NO_ACCIDENT
    what = [taxonomy.kind(kind).title.lower() for kind in kinds]
    what.append(taxonomy.mode(mode).title.lower() if accident else "nothing")
    return Event(
        f"{SYNTHETIC}-{k:04d}",
        task,
        str(rng.choice(PLATFORMS)),
        str(rng.choice(ENVIRONMENTS)),
        relation_of(task),
        deviation_of(kinds, taxonomy),
        precursors,
        f"synthetic: {', then '.join(what)}",
        mode,
        until if accident else None,
        round(until + float(rng.uniform(0.5, 2.0)), 2),
        coder,
        source=SYNTHETIC,
    )


def _ordered(mode: str, kinds: list[str], taxonomy: Taxonomy, rng: np.random.Generator) -> list[str]:
    """The kinds in random order, those of the mode's cascade mostly in Table 3's."""
    mixed = [kinds[k] for k in rng.permutation(len(kinds))]
    cascade = taxonomy.mode(mode).cascade if mode != NO_ACCIDENT else ()
    if rng.random() >= IN_ORDER:
        return mixed
    ordered = iter(sorted((k for k in mixed if k in cascade), key=cascade.index))
    return [next(ordered) if k in cascade else k for k in mixed]


def _end(onset: float, until: float, rng: np.random.Generator) -> float | None:
    """None for about half of them: they last to the outcome."""
    end = round(onset + float(rng.lognormal(np.log(0.6), 0.5)), 2)
    return None if rng.random() < 0.5 or end >= until else end
