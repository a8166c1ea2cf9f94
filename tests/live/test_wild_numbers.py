"""Numbers that a peer chooses stay within what a status, a journal and a lease can hold."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

sys.path.append(str(Path(__file__).parent))
from robot import until

from foreshock.errors import ConfigError
from foreshock.link import LinkSettings, open_link
from foreshock.live._stream import Stream
from foreshock.messages import Scalar
from foreshock.records import Sample
from foreshock.wire import Codec, Keys, pack_attachment

pytest.importorskip("zenoh")
LARGEST = 2**63 - 1


@pytest.fixture
def session() -> Iterator[Any]:
    opened: Any = open_link(LinkSettings("peer", (), ()))
    with opened:
        yield opened


def test_no_number_of_a_peer_leaves_64_bits(session: Any) -> None:
    codec = Codec()
    stream = Stream(session, Keys("robot"), "robot/a/b", Scalar, codec, 0.1)
    payload, found = codec.encode(Scalar(1.0), 0), list[Sample]()
    numbers = (1, LARGEST, -LARGEST - 1, 0, 7, 2**61 - 1, 1 - 2**61)
    for k, gid in enumerate(range(8)):  # each sender begins anew, when the one before has been silent
        for sequence in numbers:
            for stamp_ns in numbers:
                attachment = pack_attachment(sequence, stamp_ns, bytes([gid]) * 16)
                session.put(stream.key, payload, attachment=attachment)
                sample, _ = until(lambda k=k: stream.take(k * 10**10), "it arrives")
                if sample is not None:
                    found.append(sample)
    assert found
    for sample in found:
        assert -LARGEST <= sample.stamp_ns <= LARGEST
        msgspec.json.encode(sample.stamp_ns)
    assert msgspec.json.decode(msgspec.json.encode(stream.counts), type=type(stream.counts)) == stream.counts
    assert stream.counts.garbage > 0
    assert stream.counts.gaps <= 2**53


@pytest.mark.parametrize("address", ["127.evil.example:7447", "localhost.evil.example:7447", "10.0.0.1:7447", "[::]:7"])
def test_what_only_looks_like_loopback_is_not(address: str) -> None:
    with pytest.raises(ConfigError, match="beyond this machine"):
        LinkSettings("peer", (f"tcp/{address}",))


@pytest.mark.parametrize("address", ["127.0.0.1:7447", "127.8.8.8:7447", "localhost:7447", "[::1]:7447"])
def test_loopback_is(address: str) -> None:
    LinkSettings("peer", (f"tcp/{address}",))
