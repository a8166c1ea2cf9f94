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
        peaks: (first, last, severity) of stretches of presence, each less severe than the one before: the first is the
            window's maximum. The last ends at last_ns.
        due_ns: before this, nothing recurs, expires or needs a new peak while it stays present and gets no worse.
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
    due_ns: int
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
    before = evidence.tracks
    begun = [key for key, seen in observed.items() if seen.present and key not in before]
    if not begun and not before:
        return NOTHING, ()
    lost = frozenset(frozen)
    tracks: dict[Key, Track] = {}
    fresh = set(begun)
    for key, track in before.items():
        seen, running = observed.get(key), track.frozen_ns < 0
        if seen is None and running and carried is not None and key in carried and key[2] not in lost:
            seen = track.seen
        if seen is None:
            if running:
                track = msgspec.structs.replace(track, frozen_ns=now_ns)
        else:
            if not running:
                track = _thaw(track, now_ns)
            local = now_ns - track.stopped_ns
            if not seen.present:
                track = msgspec.structs.replace(track, present=False, seen=seen)
            elif track.present and local < track.due_ns and seen.severity <= track.peaks[-1][2]:
                tracks[key] = msgspec.structs.replace(track, last_ns=local, seen=seen)
                continue
            else:
                if not track.present:
                    fresh.add(key)
                track = _present(track, seen, local, recur, span)
        kept = _expire(track, now_ns, span)
        if kept is not None:
            tracks[key] = kept
    if begun:
        tracks |= {key: _begun(observed[key], now_ns) for key in begun}
        tracks = {key: tracks[key] for key in sorted(tracks)}
    return Evidence(tracks), _merge(tracks, window, now_ns, fresh)


def _begun(seen: Indication, now_ns: int) -> Track:
    stamp = min(seen.stamp_ns, now_ns)
    peak = (stamp, now_ns, seen.severity)
    return Track(True, stamp, ((stamp, now_ns),), (stamp,), now_ns, (peak,), 0, 0, -1, seen)


def _thaw(track: Track, now_ns: int) -> Track:
    stopped = track.stopped_ns + now_ns - track.frozen_ns
    return msgspec.structs.replace(track, stopped_ns=stopped, frozen_ns=-1)


def _present(old: Track, seen: Indication, local_ns: int, recur_ns: int, span_ns: int) -> Track:
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
    peaks, severity, first = old.peaks, seen.severity, local_ns
    if peaks:
        begun, _, peak = peaks[-1]
        if local_ns - begun >= BUCKET_NS:
            peaks = (*peaks[:-1], (begun, old.last_ns, peak))
        else:
            first, severity, peaks = begun, severity if severity > peak else peak, peaks[:-1]
    while peaks and peaks[-1][2] <= severity:
        peaks = peaks[:-1]
    peaks = (*peaks, (first, local_ns, severity))
    oldest = [*occurrences[:1], peaks[0][1], *[end for _, end in stretches[:-1]]]
    newest = occurrences[-1] if occurrences else onset
    due = min(first + BUCKET_NS, newest + recur_ns, min(oldest) + span_ns)
    return Track(True, onset, stretches, occurrences, local_ns, peaks, due, old.stopped_ns, -1, seen)


def _expire(track: Track, now_ns: int, span_ns: int) -> Track | None:
    """The track without what is older than the window; None if nothing is left."""
    stop = now_ns if track.frozen_ns < 0 else track.frozen_ns
    horizon = stop - track.stopped_ns - span_ns
    if not track.present and track.last_ns <= horizon:
        return None
    occurrences, peaks, stretches = track.occurrences_ns, track.peaks, track.stretches
    if (
        (not occurrences or occurrences[0] > horizon)
        and (not peaks or (peaks[0][1] if len(peaks) > 1 else track.last_ns) > horizon)
        and (len(stretches) == 1 or stretches[0][1] > horizon)
    ):
        return track
    occurrences = tuple(t for t in occurrences if t > horizon)
    peaks = tuple(p for p in peaks[:-1] if p[1] > horizon) + (peaks[-1:] if track.last_ns > horizon else ())
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
    found: list[Precursor] = []
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
        phase: Phase = "onset" if fresh and key in fresh else "ongoing" if track.present else "cleared"
        onsets = (stretches[0][0],) if len(stretches) == 1 else tuple(sorted([source for source, _ in stretches]))
        mine = Precursor(
            kind,
            subject,
            phase,
            peaks[0][2] if peaks else seen.severity,
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
        if found and found[-1].kind == kind and found[-1].subject == subject:
            mine = _stronger(found.pop(), mine)
        found.append(mine)
    return tuple(found)


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
