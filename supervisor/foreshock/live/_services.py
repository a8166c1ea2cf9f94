"""Questions that a live supervisor answers: status, taxonomy, configuration, recent decisions, an operator's reset."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from typing import Any

import msgspec

from foreshock.errors import BadInputError
from foreshock.journal import OperatorReset
from foreshock.live._config import RunConfig
from foreshock.live._status import Status
from foreshock.supervisor import Supervisor
from foreshock.taxonomy import Taxonomy
from foreshock.wire import Keys

__all__ = ["MOST_PEERS", "ResetRequest", "Services"]

RING = 16
AT_ONCE = 4
"""Questions of a kind that are answered in one tick; the others wait in their ring."""
MOST_BYTES = 1_000
MOST_PEERS = 256
"""Tokens that are kept."""
MOST_LETTERS = 100
"""Of a name of a dimension, and of what is wrong with a question: no more is looked up, or said of it."""


class ResetRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Payload of a reset: who asks, what was checked, which dimension of trust (``""``: all)."""

    who: str
    why: str
    dimension: str = ""


class Services:
    """Queryables whose questions wait in rings until the tick's end.

    Args:
        session: open Zenoh session.
        keys: of the robot.

    Attributes:
        crowded: there were once more peers than are kept, so that twins may be unknown.
    """

    def __init__(self, session: Any, keys: Keys) -> None:
        import zenoh

        self.crowded = False
        self._asked = {
            name: session.declare_queryable(keys.service(name), zenoh.handlers.RingChannel(RING))
            for name in ("status", "taxonomy", "config", "history", "reset")
        }
        self._tokens = session.liveliness().declare_subscriber(
            keys.alive("**", "").rstrip("/"), zenoh.handlers.RingChannel(4 * MOST_PEERS), history=True
        )
        self._alive: dict[str, None] = {}
        self._lost: type[Exception] = zenoh.ZError
        self._put = zenoh.SampleKind.PUT

    def peers(self) -> tuple[str, ...]:
        """Tokens that are up: ``<role>/<name>``."""
        while (token := self._tokens.try_recv()) is not None:
            name = str(token.key_expr).partition("/@/alive/")[2]
            if token.kind == self._put:
                self._alive[name] = None
                if len(self._alive) > MOST_PEERS:
                    del self._alive[name]
                    self.crowded = True
            else:
                self._alive.pop(name, None)
        return tuple(sorted(self._alive))

    def resets(self, supervisor: Supervisor, now_ns: int) -> Iterator[OperatorReset]:
        """Do what operators ask for; the records."""
        for query in _taken(self._asked["reset"]):
            try:
                request = _reset_of(query.payload)
                record = supervisor.operator_reset(request.who, request.why, now_ns, request.dimension)
            except BadInputError as e:
                with suppress(self._lost):
                    query.reply_err(str(e).encode())
            else:
                with suppress(self._lost):  # it is done and recorded, even where nobody waits for the answer
                    query.reply(query.key_expr, msgspec.json.encode(record))
                yield record
            query.drop()

    def refuse_resets(self, why: str) -> None:
        """Tell operators that there is nothing to reset."""
        for query in _taken(self._asked["reset"]):
            with suppress(self._lost):
                query.reply_err(why.encode())
            query.drop()

    def answer(
        self,
        status: Callable[[], Status],
        run: RunConfig,
        taxonomy: Taxonomy,
        history: Iterable[tuple[int, bytes]],
    ) -> None:
        """Answer what was asked since the last tick."""
        answers: dict[str, Callable[[], bytes]] = {
            "status": lambda: msgspec.json.encode(status()),
            "taxonomy": lambda: msgspec.json.encode(taxonomy),
            "config": lambda: msgspec.json.encode(run.config),
            # length before each: a list of CDR payloads in one reply, so that they come in order or not at all
            "history": lambda: b"".join(len(data).to_bytes(4, "little") + data for _, data in history),
        }
        for name, give in answers.items():
            answer = None
            for query in _taken(self._asked[name]):
                answer = give() if answer is None else answer
                with suppress(self._lost):
                    query.reply(query.key_expr, answer)
                query.drop()


def _reset_of(payload: Any) -> ResetRequest:
    """What an operator asks.

    Raises:
        BadInputError: it is too long or no such request; it does not repeat what a peer may have made long.
    """
    size = 0 if payload is None else len(payload)
    if size > MOST_BYTES:
        raise BadInputError("reset", f"{size} bytes, at most {MOST_BYTES} are read")
    try:
        request = msgspec.json.decode(payload.to_bytes() if size else b"", type=ResetRequest)
    except (msgspec.MsgspecError, UnicodeDecodeError) as e:
        problem = str(e)
        if len(problem) > MOST_LETTERS:
            problem = "it is no JSON object of who, why and dimension"
        raise BadInputError("reset", problem) from None
    if len(request.dimension) > MOST_LETTERS:
        raise BadInputError("reset.dimension", f"{len(request.dimension)} letters, at most {MOST_LETTERS} are read")
    return request


def _taken(queryable: Any) -> Iterator[Any]:
    for _ in range(AT_ONCE):
        query = queryable.try_recv()
        if query is None:
            return
        yield query
