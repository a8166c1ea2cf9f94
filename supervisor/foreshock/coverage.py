"""Who is observed: what the detectors gave in a tick, what nobody watches now, and the health that changed.

Silence is not safety: a kind of which its detector does not speak is unobserved, never absent.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

import msgspec

from foreshock.channels import ChannelView
from foreshock.containment import Contained
from foreshock.evidence import Evidence, Key
from foreshock.records import ChannelState, Health, Indication

__all__ = [
    "HealthMap",
    "Heard",
    "Prediction",
    "Said",
    "listen",
    "news",
    "partial",
    "standing_predictions",
    "unobserved",
]

Said = Mapping[Key, Indication]
"""What one detector says."""

HealthMap = Mapping[str, tuple[ChannelState, str]]
"""State and reason by detector or channel."""

Prediction = tuple[int, float]
"""Tick at which it was made, in ns, and its time_to_event_s."""

OK: tuple[ChannelState, str] = ("ok", "")


class Heard(msgspec.Struct, frozen=True):
    """What the detectors gave in one tick.

    Attributes:
        observed: indications of the detectors that were updated.
        carried: last indications of each detector that is ok, updated or not due.
        standing: those of detectors that were not due; their verdict still stands.
        lost: detectors of which nothing is observed now.
        silent: declared kinds of which a detector does not speak, where there are any.
        health: of every detector.
        judged: detectors on which a verdict fell in this tick.
    """

    observed: dict[Key, Indication]
    carried: dict[str, Said]
    standing: dict[Key, Indication]
    lost: list[str]
    silent: dict[str, frozenset[str]]
    health: dict[str, tuple[ChannelState, str]]
    judged: list[str]


def listen(
    detectors: Sequence[Contained],
    channels: Mapping[str, ChannelView],
    before: Mapping[str, Said],
    verdicts: Mapping[str, str],
    now_ns: int,
) -> Heard:
    """Update every detector that is due.

    Args:
        detectors: contained, by id.
        channels: view of every channel.
        before: last indications of the detectors that were ok in the previous tick.
        verdicts: recorded wall-clock verdicts by detector id.
        now_ns: time of the tick.
    """
    heard = Heard({}, {}, {}, [], {}, {}, [])
    for d in detectors:
        name = d.spec.id
        outcome = d.tick(now_ns, channels, verdicts.get(name))
        if outcome.state != "ok":
            heard.health[name] = (outcome.state, outcome.reason)
            heard.lost.append(name)
            heard.silent[name] = d.kinds
            if outcome.judged:
                heard.judged.append(name)
            continue
        heard.health[name] = OK
        if outcome.due:
            said = outcome.said
            heard.observed.update(said)
        else:
            said = before.get(name, {})
            heard.standing.update(said)
        heard.carried[name] = said
        silent = d.kinds.difference([kind for kind, _, _ in said])
        if silent:
            heard.silent[name] = silent
    return heard


def unobserved(heard: Heard, before: Mapping[str, Said]) -> set[str]:
    """Kinds that some detector does not observe now and that nobody else observes in its place.

    Another detector stands in only if it speaks of every subject of which the silent one spoke when it was last ok: the
    right foot's slip detector does not watch the left foot.

    Args:
        heard: in this tick.
        before: what every detector said when it was last ok, before this tick.
    """
    if not heard.silent:
        return set()
    now = {key[:2] for said in heard.carried.values() for key in said}
    found: set[str] = set()
    for name, kinds in heard.silent.items():
        for kind in kinds:
            owed = {key[:2] for key in before.get(name, ()) if key[0] == kind}
            if not owed or not owed <= now:
                found.add(kind)
    return found


def partial(heard: Heard, evidence: Evidence) -> dict[str, list[str]]:
    """What detectors that are otherwise ok do not speak of although they should: kinds, and ``kind@subject``."""
    found = {name: sorted(kinds) for name, kinds in heard.silent.items() if name not in heard.lost}
    for kind, subject, name in sorted([key for key, track in evidence.tracks.items() if track.frozen_ns >= 0]):
        if name not in heard.lost and kind not in heard.silent.get(name, ()):
            found.setdefault(name, []).append(f"{kind}@{subject}" if subject else kind)
    return found


def standing_predictions(
    before: Mapping[Key, Prediction], heard: Heard, evidence: Evidence, now_ns: int
) -> dict[Key, Prediction]:
    """Predictions that stand: silence does not withdraw one while its evidence stands, and its time runs on."""
    said = {k: (now_ns, t) for k, i in heard.observed.items() if (t := i.time_to_event_s) is not None}
    kept = {k: p for k, p in before.items() if k not in heard.observed and (k in evidence.tracks or k[2] in heard.lost)}
    return {**kept, **said} if kept else said


def news(
    before: HealthMap,
    after: HealthMap,
    steady: Callable[[], Collection[str]],
    now_ns: int,
    judged: Collection[str] = (),
) -> tuple[Health, ...]:
    """Health that changed; a reason that only counts on (an age) is not news, one of the steady names is.

    A verdict is told even if the last tick ended in the same one: a replay needs both.
    """
    if before == after and not judged:
        return ()
    told = steady()
    changed = [
        Health(now_ns, name, state, reason)
        for name, (state, reason) in after.items()
        if name not in before
        or before[name][0] != state
        or name in judged
        or ((state == "ok" or name in told) and before[name][1] != reason)
    ]
    changed += [Health(now_ns, name, "ok") for name in before if name not in after]
    return tuple(changed)
