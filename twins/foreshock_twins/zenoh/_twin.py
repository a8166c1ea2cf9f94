"""The client's side of stepping a twin by query."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from foreshock.errors import BadInputError, TwinError, WireError
from foreshock.link import LinkSettings, keys_of, open_link
from foreshock.records import Intervention, Sample
from foreshock.twin import Channel, Parameters, TwinEvent
from foreshock.wire import BY_ROS, Codec, Hello, Request, Stepped, check_hello, unpack_samples

if TYPE_CHECKING:
    from foreshock_twins.zenoh import ZenohTwinConfig

__all__ = ["ZenohTwin"]


class ZenohTwin:
    """Implements foreshock.twin.Twin.

    Args:
        config: where it is.
        robot: whose twin.
        scratch: unused.

    Raises:
        TwinError: nobody answers, or what answers declares something else.
    """

    stepped = True

    def __init__(self, config: ZenohTwinConfig, robot: str, scratch: Path) -> None:  # noqa: ARG002 # the port
        link = LinkSettings("client", (), (config.endpoint,), config.remote, tls=config.tls)
        self._key, self._timeout_s = keys_of(link, robot).service("twin"), config.timeout_s
        self._endpoint, self._codec = config.endpoint, Codec()
        try:
            self._session: Any = open_link(link)
        except BadInputError as e:
            raise TwinError("error", f"no twin at {config.endpoint}: {e}") from None
        try:
            self._hello = self._ask(Request("hello"), Hello)
            check_hello(self._hello, f"twin at {config.endpoint}")
            if self._hello.robot != robot:
                raise WireError(f"twin at {config.endpoint}: robot", f"{self._hello.robot!r}, {robot!r} is expected")
        except WireError as e:
            self.close()
            raise TwinError("error", str(e)) from None
        except TwinError:
            self.close()
            raise
        self.channels = tuple(Channel(c.name, BY_ROS[c.type].__name__, c.period_ns) for c in self._hello.channels)
        self.period_ns = self._hello.period_ns
        self.actions = frozenset(self._hello.actions)
        self._waiting: list[Intervention] = []
        self._now = Stepped(())

    def reset(self, parameters: Parameters, seed: int) -> None:
        """Back to time 0."""
        self._waiting.clear()
        self._now = self._ask(Request("reset", dict(parameters), seed), Stepped)

    def advance(self, until_ns: int) -> Sequence[Sample]:
        """Interventions, then time, in one question."""
        request = Request("advance", until_ns=until_ns, interventions=tuple(self._waiting))
        self._waiting.clear()
        self._now = self._ask(request, Stepped)
        try:
            return unpack_samples(self._now.samples, self._codec)
        except WireError as e:
            raise TwinError("error", str(e)) from None

    def intervene(self, intervention: Intervention) -> None:
        """It goes with the next advance."""
        self._waiting.append(intervention)

    def events(self) -> Sequence[TwinEvent]:
        """As of the last advance."""
        return self._now.events

    def probes(self) -> Mapping[str, float]:
        """As of the last advance."""
        return {name: math.nan if value is None else value for name, value in self._now.probes.items()}

    def close(self) -> None:
        """Close the link; idempotent."""
        if self._session is not None:
            self._session.close()
            self._session = None

    def _ask(self, request: Request, answer: type[Any]) -> Any:
        payload = msgspec.json.encode(request)
        for reply in self._session.get(self._key, payload=payload, timeout=self._timeout_s):
            if reply.ok is None:
                raise TwinError("error", f"the twin at {self._endpoint} said: {reply.err.payload.to_string()}")
            try:
                return msgspec.json.decode(reply.ok.payload.to_bytes(), type=answer)
            except (msgspec.MsgspecError, UnicodeDecodeError) as e:
                raise TwinError("error", f"the twin at {self._endpoint} answered {request.op!r} wrongly: {e}") from None
        detail = f"no answer to {request.op!r} from {self._endpoint} on {self._key} within {self._timeout_s:g} s"
        raise TwinError("hang", detail)
