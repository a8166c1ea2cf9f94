"""The evidence window: indications in, precursors out.

A track follows one (kind, subject) as one detector sees it. An onset is one occurrence; a condition that persists
counts one more per recurrence period.
At loss of observation a track freezes: its clock stands still, so that neither its share of
m nor of q fades, and it runs on when the detector observes again. Evidence is cleared only by observing its absence.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Literal

import msgspec

from foreshock._strict import within
from foreshock.records import Indication, Phase, Precursor

__all__ = ["Evidence", "Key", "Track", "Window", "step"]

Key = tuple[str, str, str]
"""kind, subject, detector."""


class Window(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How long evidence counts.

    Attributes:
        length_s: length of the window; 1.5 s is the upper end of the paper's overlap of 0.5 to 1.5 s (section 3.2.2).
        recurrence_s: a condition that persists counts one more occurrence per this time; 0 means length_s.
        kernel: ``boxcar`` as in the paper, or ``exponential`` with time constant length_s, cut off at five of them.

    Raises:
        ConfigError: a time that is not finite or shorter than SHORTEST_S.
    """

    length_s: float = 1.5
    recurrence_s: float = 0.0
    kernel: Literal["boxcar", "exponential"] = "boxcar"

    def __post_init__(self) -> None:
        within("window.length_s", self.length_s, SHORTEST_S)
        if self.recurrence_s != 0.0:
            within("window.recurrence_s", self.recurrence_s, SHORTEST_S)


SHORTEST_S = 0.001
"""A shorter window or recurrence period (1 kHz) would count ticks instead of conditions."""


class Track(msgspec.Struct, frozen=True, gc=False):
    """What one detector saw of one (kind, subject). Times are on the track's own clock, which stops when frozen.

    Attributes:
        present: verdict of the last observation.
        onset_ns: the current or last onset.
        stretches: (source stamp of the onset, end) of stretches of presence that still count; the last ends at last_ns.
        occurrences_ns: occurrences that still count.
        last_ns: when it was last present.
        peaks: (first, last, severity) of stretches of presence, for the window's maximum.
        stopped_ns: how long the clock has stood still in all.
        frozen_ns: since when it stands still, -1 if it runs.
        seen: the last indication.
    """

    present: bool
    onset_ns: int
    stretches: tuple[tuple[int, int], ...]
    occurrences_ns: tuple[int, ...]
    last_ns: int
    peaks: tuple[tuple[int, int, float], ...]
    stopped_ns: int
    frozen_ns: int
    seen: Indication


class Evidence(msgspec.Struct, frozen=True):
    """All tracks that still count, sorted by key."""

    tracks: Mapping[Key, Track] = {}


NOTHING = Evidence()

BUCKET_NS = 100_000_000
"""Severities closer than this share one entry, kept until its newest expires: never shorter than the window."""


def step(
    evidence: Evidence,
    window: Window,
    now_ns: int,
    observed: Mapping[Key, Indication],
    frozen: Iterable[str] = (),
    carried: Mapping[Key, Indication] | None = None,
) -> tuple[Evidence, tuple[Precursor, ...]]:
    """The evidence after one tick, and its precursors sorted by kind and subject.

    Args:
        evidence: before the tick.
        window: its length and kernel.
        now_ns: time of the tick; expiry is judged by it, order by source stamps.
        observed: indications of detectors that were updated in this tick.
        frozen: detectors of which nothing is observed now.
        carried: indications of healthy detectors that were not due in this tick; their verdict still stands.
    """
    span = round(window.length_s * 1e9) * (5 if window.kernel == "exponential" else 1)
    recur = round((window.recurrence_s or window.length_s) * 1e9)
    lost = frozenset(frozen)
    before = evidence.tracks
    tracks: dict[Key, Track] = {}
    fresh: set[Key] = set()
    for key, seen in observed.items():
        old = before.get(key)
        if old is None:
            if not seen.present:
                continue
            fresh.add(key)
            stamp = min(seen.stamp_ns, now_ns)
            peak = ((stamp, now_ns, seen.severity),)
            tracks[key] = Track(True, stamp, ((stamp, now_ns),), (stamp,), now_ns, peak, 0, -1, seen)
            continue
        if old.frozen_ns >= 0:
            old = _thaw(old, now_ns)
        local = now_ns - old.stopped_ns
        if seen.present:
            if not old.present:
                fresh.add(key)
            tracks[key] = _present(old, seen, local, recur)
        else:
            tracks[key] = msgspec.structs.replace(old, present=False, seen=seen)
    if not before.keys() <= tracks.keys():
        for key, old in before.items():
            if key in tracks:
                continue
            if key[2] not in lost and carried is not None and key in carried:
                local = now_ns - old.stopped_ns
                tracks[key] = _present(old, old.seen, local, recur) if old.present and old.frozen_ns < 0 else old
            elif old.frozen_ns < 0:
                tracks[key] = msgspec.structs.replace(old, frozen_ns=now_ns)
            else:
                tracks[key] = old
    if not tracks:
        return NOTHING, ()
    # sorted by key: most ticks have the keys of the last, which are
    order: Iterable[Key] = before if tracks.keys() == before.keys() else sorted(tracks)
    kept = {key: t for key in order if (t := _expire(tracks[key], now_ns, span)) is not None}
    return Evidence(kept), _merge(kept, window, now_ns, fresh)


def _thaw(track: Track, now_ns: int) -> Track:
    stopped = track.stopped_ns + now_ns - track.frozen_ns
    return msgspec.structs.replace(track, stopped_ns=stopped, frozen_ns=-1)


NO_PEAK = (-(1 << 62), 0, 0.0)


def _present(old: Track, seen: Indication, local_ns: int, recur_ns: int) -> Track:
    occurrences, onset, stretches = old.occurrences_ns, old.onset_ns, old.stretches
    if not old.present:
        onset = min(seen.stamp_ns - old.stopped_ns, local_ns)
        occurrences = tuple(sorted((*occurrences, onset)))
        ended = (stretches[-1][0], old.last_ns)
        stretches = (*stretches[:-1], ended, (min(seen.stamp_ns, local_ns + old.stopped_ns), local_ns))
    else:
        newest = occurrences[-1] if occurrences else onset
        while newest + recur_ns <= local_ns:
            newest += recur_ns
            occurrences = (*occurrences, newest)
    peaks, severity = old.peaks, seen.severity
    first, _, peak = peaks[-1] if peaks else NO_PEAK
    if local_ns - first < BUCKET_NS:
        last = (first, local_ns, severity if severity > peak else peak)
        peaks = (last,) if len(peaks) == 1 else (*peaks[:-1], last)
    else:
        while peaks and peaks[-1][2] <= severity:
            peaks = peaks[:-1]
        peaks = (*peaks, (local_ns, local_ns, severity))
    return Track(True, onset, stretches, occurrences, local_ns, peaks, old.stopped_ns, -1, seen)


def _expire(track: Track, now_ns: int, span_ns: int) -> Track | None:
    """The track without what is older than the window; None if nothing is left."""
    stop = now_ns if track.frozen_ns < 0 else track.frozen_ns
    horizon = stop - track.stopped_ns - span_ns
    if not track.present and track.last_ns <= horizon:
        return None
    occurrences, peaks, stretches = track.occurrences_ns, track.peaks, track.stretches
    if (
        (not occurrences or occurrences[0] > horizon)
        and (not peaks or peaks[0][1] > horizon)
        and (len(stretches) == 1 or stretches[0][1] > horizon)
    ):
        return track
    occurrences = tuple(t for t in occurrences if t > horizon)
    peaks = tuple(p for p in peaks if p[1] > horizon)
    stretches = tuple(s for s in stretches[:-1] if s[1] > horizon) + stretches[-1:]
    return msgspec.structs.replace(track, occurrences_ns=occurrences, peaks=peaks, stretches=stretches)


def _merge(tracks: Mapping[Key, Track], window: Window, now_ns: int, fresh: set[Key]) -> tuple[Precursor, ...]:
    """One precursor per (kind, subject): several detectors of one kind count once, by their maximum.

    Args:
        tracks: sorted by key.
        window: its kernel.
        now_ns: time of the tick.
        fresh: keys whose onset is in this tick.
    """
    found: dict[tuple[str, str], Precursor] = {}
    boxcar, tau = window.kernel == "boxcar", window.length_s * 1e9
    for key, track in tracks.items():
        kind, subject, detector = key
        frozen, seen, peaks, stretches = track.frozen_ns >= 0, track.seen, track.peaks, track.stretches
        if boxcar:
            weight, q = 1.0, float(len(track.occurrences_ns) or 1)
        else:
            local = (track.frozen_ns if frozen else now_ns) - track.stopped_ns
            weight = 1.0 if track.present else math.exp((track.last_ns - local) / tau)
            q = max(weight, math.fsum([math.exp((t - local) / tau) for t in track.occurrences_ns]))
        phase: Phase = "onset" if key in fresh else "ongoing" if track.present else "cleared"
        peak = peaks[0][2] if len(peaks) == 1 else max([p[2] for p in peaks], default=seen.severity)
        onsets = (stretches[0][0],) if len(stretches) == 1 else tuple(sorted([source for source, _ in stretches]))
        mine = Precursor(
            kind,
            subject,
            phase,
            peak,
            q,
            weight,
            onsets[0],
            detector,
            frozen,
            seen.statistic,
            seen.threshold,
            seen.unit,
            seen.evidence,
            onsets,
        )
        pair = (kind, subject)
        if pair in found:
            mine = _stronger(found[pair], mine)
        found[pair] = mine
    return tuple(found.values())


PHASES: Mapping[Phase, int] = {"cleared": 0, "ongoing": 1, "onset": 2}


def _stronger(a: Precursor, b: Precursor) -> Precursor:
    lead = a if (a.severity, a.weight) >= (b.severity, b.weight) else b
    phase = a.phase if PHASES[a.phase] >= PHASES[b.phase] else b.phase
    if phase == "onset" and "ongoing" in (a.phase, b.phase):
        phase = "ongoing"
    return msgspec.structs.replace(
        lead,
        phase=phase,
        weight=max(a.weight, b.weight),
        occurrences=max(a.occurrences, b.occurrences),
        onset_ns=min(a.onset_ns, b.onset_ns),
        onsets_ns=tuple(sorted({*a.onsets_ns, *b.onsets_ns})),
        frozen=a.frozen and b.frozen,
    )
