"""What sensors and transports do to a recording: silence, NaN, values that stand still, duplicates, disorder."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from foreshock.records import Sample
from foreshock.session.fields import not_a_number
from foreshock.testing.rig import arrival_ns

__all__ = ["disordered", "duplicated", "frozen", "not_a_number", "silenced", "spoiled"]


def silenced(samples: Sequence[Sample], channel: str, from_ns: int) -> tuple[Sample, ...]:
    """The samples without those that arrive on a channel after from_ns."""
    return tuple(s for s in samples if s.channel != channel or arrival_ns(s) <= from_ns)


def spoiled(samples: Sequence[Sample], channel: str, from_ns: int) -> tuple[Sample, ...]:
    """The samples with NaN for every number that arrives on a channel after from_ns.

    A message in which no number is a float, a Humans with nobody in it for one, is dropped instead.
    """
    out: list[Sample] = []
    for s in samples:
        if s.channel == channel and arrival_ns(s) > from_ns:
            value = not_a_number(s.value)
            if value == s.value:
                continue
            s = msgspec.structs.replace(s, value=value)
        out.append(s)
    return tuple(out)


def frozen(samples: Sequence[Sample], channel: str, from_ns: int) -> tuple[Sample, ...]:
    """The samples with the last value that arrived on a channel by from_ns in every later one; stamps go on."""
    before = [s for s in samples if s.channel == channel and arrival_ns(s) <= from_ns]
    return tuple(
        msgspec.structs.replace(s, value=before[-1].value)
        if before and s.channel == channel and arrival_ns(s) > from_ns
        else s
        for s in samples
    )


def duplicated(samples: Sequence[Sample]) -> tuple[Sample, ...]:
    """Every sample twice, as a transport that repeats what it is not sure to have delivered."""
    return tuple(s for sample in samples for s in (sample, sample))


def disordered(samples: Sequence[Sample]) -> tuple[Sample, ...]:
    """Every second sample of a channel overtakes the one before it; arrival times stay in order."""
    out = list(samples)
    places: dict[str, list[int]] = {}
    for k, s in enumerate(samples):
        places.setdefault(s.channel, []).append(k)
    for ks in places.values():
        for first, second in zip(ks[::2], ks[1::2], strict=False):
            out[first] = _arriving(samples[second], samples[second])
            out[second] = _arriving(samples[first], samples[second])
    out.sort(key=arrival_ns)
    return tuple(out)


def _arriving(sample: Sample, when: Sample) -> Sample:
    return msgspec.structs.replace(sample, received_ns=arrival_ns(when))
