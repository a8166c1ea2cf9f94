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

__all__ = ["ResetRequest", "Services"]

RING = 16
AT_ONCE = 4
"""Questions of a kind that are answered in one tick; the others wait in their ring."""
MOST_BYTES = 10_000


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
    """

    def __init__(self, session: Any, keys: Keys) -> None:
        import zenoh

        self._asked = {
            name: session.declare_queryable(keys.service(name), zenoh.handlers.RingChannel(RING))
            for name in ("status", "taxonomy", "config", "history", "reset")
        }
        self._tokens = session.liveliness().declare_subscriber(
            keys.alive("**", "").rstrip("/"), zenoh.handlers.RingChannel(256), history=True
        )
        self._alive: dict[str, None] = {}
        self._lost: type[Exception] = zenoh.ZError
        self._drop = zenoh.CongestionControl.DROP
        self._put = zenoh.SampleKind.PUT

    def peers(self) -> tuple[str, ...]:
        """Tokens that are up: ``<role>/<name>``."""
        while (token := self._tokens.try_recv()) is not None:
            name = str(token.key_expr).partition("/@/alive/")[2]
            if token.kind == self._put:
                if len(self._alive) < 256:
                    self._alive[name] = None
            else:
                self._alive.pop(name, None)
        return tuple(sorted(self._alive))

    def resets(self, supervisor: Supervisor, now_ns: int) -> Iterator[OperatorReset]:
        """Do what operators ask for; the records."""
        for query in _taken(self._asked["reset"]):
            payload = query.payload.to_bytes() if query.payload is not None else b""
            try:
                if len(payload) > MOST_BYTES:
                    raise BadInputError("reset", f"{len(payload)} bytes")
                request = msgspec.json.decode(payload, type=ResetRequest)
                record = supervisor.operator_reset(request.who, request.why, now_ns, request.dimension)
            except (BadInputError, msgspec.MsgspecError) as e:
                with suppress(self._lost):
                    query.reply_err(str(e).encode())
            else:
                with suppress(self._lost):  # it is done and recorded, even where nobody waits for the answer
                    query.reply(query.key_expr, msgspec.json.encode(record), congestion_control=self._drop)
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
            for query in _taken(self._asked[name], AT_ONCE):
                answer = give() if answer is None else answer
                # a peer that asks and takes no answer must not keep the tick waiting
                with suppress(self._lost):
                    query.reply(query.key_expr, answer, congestion_control=self._drop)
                query.drop()


def _taken(queryable: Any, most: int = RING) -> Iterator[Any]:
    for _ in range(most):
        query = queryable.try_recv()
        if query is None:
            return
        yield query
