"""What an operator asks is answered in turn, whatever others send under the name of a reset."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

sys.path.append(str(Path(__file__).parent))
from robot import until

from foreshock.config import Config, DetectorEntry, SupervisorSettings
from foreshock.link import LinkSettings, open_link
from foreshock.live._services import AT_ONCE, Services
from foreshock.supervisor import Supervisor
from foreshock.wire import Keys

pytest.importorskip("zenoh")
KEYS = Keys("robot")
GOOD = b'{"who": "jane", "why": "gripper seen to"}'


@pytest.fixture
def session() -> Iterator[Any]:
    opened: Any = open_link(LinkSettings("peer", (), ()))
    with opened:
        yield opened


@pytest.fixture
def supervisor() -> Supervisor:
    return Supervisor(Config(supervisor=SupervisorSettings(robot="robot"), detectors=(DetectorEntry("grip"),)))


def ask(session: Any, payload: bytes) -> Any:
    import zenoh

    return session.get(KEYS.service("reset"), zenoh.handlers.FifoChannel(2), payload=payload, timeout=20.0)


def answer(asked: Any, serve: Callable[[], object] = lambda: None) -> bytes:
    """What comes back, while the supervisor's end is served."""
    reply = until(lambda: (serve(), asked.try_recv())[1], "an answer")
    return bytes(reply.err.payload.to_bytes() if reply.ok is None else reply.ok.payload.to_bytes())


@pytest.mark.parametrize(
    ("payload", "said"),
    [
        (msgspec.json.encode({"who": "x", "why": "y", "dimension": "z" * 9_000}), b"bytes, at most 1000 are read"),
        (msgspec.json.encode({"who": "x", "why": "y", "dimension": "z" * 900}), b"900 letters"),
        (msgspec.json.encode({"z" * 900: "x"}), b"no JSON object of who, why and dimension"),
        (b"\xff" * 900, b"reset: "),
        (b'{"who": "\xff", "why": "y"}', b"reset: "),
        (b"", b"reset: "),
        (b'{"who": "x"}', b"missing required field `why`"),
        (b'{"who": "x", "why": "y", "dimension": "a1"}', b"did you mean 'A1'"),
    ],
)
def test_a_bad_reset_gets_a_short_answer(session: Any, supervisor: Supervisor, payload: bytes, said: bytes) -> None:
    services = Services(session, KEYS)
    found = answer(ask(session, payload), lambda: list(services.resets(supervisor, 0)))
    assert said in found
    assert len(found) < 300
    assert b"zzzzzzzzzz" not in found
    assert not supervisor.resets


def test_a_few_are_taken_in_a_tick_and_none_is_lost(session: Any, supervisor: Supervisor) -> None:
    services = Services(session, KEYS)
    asked = [ask(session, GOOD) for _ in range(3 * AT_ONCE)]
    time.sleep(0.5)  # until they wait in the ring; fewer there would only make the next line easier
    taken = []
    while sum(taken) < len(asked):
        taken.append(len(list(services.resets(supervisor, len(taken)))))
        assert len(taken) < 1000
    assert max(taken) <= AT_ONCE
    for a in asked:
        assert b"jane" in answer(a)
