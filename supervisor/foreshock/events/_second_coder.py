"""What a second coder makes of the same events: disagreement in exact numbers, so that kappa comes out as asked for."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np

from foreshock.events._template import deviation_of
from foreshock.events.schema import Event, EventPrecursor
from foreshock.taxonomy import Taxonomy

__all__ = ["recoded"]

JITTER_S = 0.06
"""Standard deviation by which the second coder's onsets differ; about two frames of a video at 30 frames per s."""

TRIES = 50
"""Events that are looked at for one without the kind."""


def recoded(
    events: Sequence[Event], coder: str, kappa: float, taxonomy: Taxonomy, rng: np.random.Generator
) -> list[Event]:
    """The events as another coder saw them.

    For presence of a kind in an event, with prevalence p the same for both coders, kappa = 1 - d / (1 - p), where d
    is the share of the first coder's precursors that the second does not have: d = (1 - kappa) (1 - p). Half of these
    are called another kind of the same class; the others are missed, and as many are seen in another event.
    Outcomes: of the accidents the share (1 - kappa) (1 - sum of squared shares) is called another mode.
    """
    every = [k.id for k in taxonomy.kinds if any(p.kind == k.id for e in events for p in e.precursors)]
    precursors = [list(e.precursors) for e in events]
    slots = [(k, p) for k, mine in enumerate(precursors) for p in mine]
    prevalence = len(slots) / max(1, len(events) * len(every))
    wrong = round((1 - kappa) * (1 - prevalence) * len(slots))
    picked = [slots[i] for i in rng.permutation(len(slots))[:wrong]]
    for turn, (k, p) in enumerate(picked):
        held = {x.kind for x in (*events[k].precursors, *precursors[k])}
        others = [o for o in every if o not in held and taxonomy.class_of(o) == taxonomy.class_of(p.kind)]
        precursors[k].remove(p)
        if turn % 2 and others:
            precursors[k].append(msgspec.structs.replace(p, kind=str(rng.choice(others))))
            continue
        for there in rng.integers(0, len(events), TRIES):
            i = int(there)
            if i != k and p.kind not in {x.kind for x in (*events[i].precursors, *precursors[i])}:
                at = round(float(rng.uniform(0.0, events[i].until_s)), 2)
                precursors[i].append(EventPrecursor(p.kind, at))
                break
    outcomes = _outcomes([e.outcome for e in events], kappa, taxonomy, rng)
    return [
        msgspec.structs.replace(
            event,
            coder=coder,
            outcome=outcome,
            precursors=tuple(sorted((_shifted(p, event, rng) for p in mine), key=lambda p: p.onset_s)),
            deviation=deviation_of((p.kind for p in mine), taxonomy),
        )
        for event, mine, outcome in zip(events, precursors, outcomes, strict=True)
    ]


def _shifted(p: EventPrecursor, event: Event, rng: np.random.Generator) -> EventPrecursor:
    shift = round(float(rng.normal(0.0, JITTER_S)), 2)
    onset = round(min(max(0.0, p.onset_s + shift), event.until_s), 2)
    return msgspec.structs.replace(p, onset_s=onset, end_s=None if p.end_s is None else max(onset, p.end_s))


def _outcomes(outcomes: Sequence[str], kappa: float, taxonomy: Taxonomy, rng: np.random.Generator) -> list[str]:
    accidents = [k for k, o in enumerate(outcomes) if o in taxonomy.codes]
    shares = [sum(o == c for o in outcomes) / max(1, len(accidents)) for c in taxonomy.codes]
    wrong = round((1 - kappa) * (1 - sum(s * s for s in shares)) * len(accidents))
    out = list(outcomes)
    for i in rng.permutation(len(accidents))[:wrong]:
        k = accidents[int(i)]
        out[k] = str(rng.choice([c for c in taxonomy.codes if c != out[k]]))
    return out
