"""Runs a detector in a child process, where it can hang, crash or exhaust memory without harm.

The child imports the plugin anew and speaks msgpack over a pipe. A hang or death raises here, so that containment
makes the detector's kinds unobserved; the next update starts a new child.
"""

from __future__ import annotations

import multiprocessing as mp
import signal
from collections.abc import Callable, Mapping, Sequence
from multiprocessing.connection import Connection
from typing import Any

import msgspec

from foreshock.detector import Detector, DetectorSpec, Inputs
from foreshock.errors import MissingExtraError, PluginError
from foreshock.records import Indication, Sample
from foreshock.verdicts import VerdictError

__all__ = ["ChildDetector", "ChildError"]

HANG_S = 1.0
"""Wall-clock time after which a child that does not answer is killed."""
START_S = 60.0


class ChildError(VerdictError):
    """The child process hung, died, raised, or answered what is no answer.

    None of these follows from the samples alone, so containment records each as a verdict that a replay can feed.
    """


class _Reset(msgspec.Struct, frozen=True, tag=True):
    seed: int


class _Update(msgspec.Struct, frozen=True, tag=True):
    now_ns: int
    latest: dict[str, Sample]
    new: dict[str, tuple[Sample, ...]]


class _Said(msgspec.Struct, frozen=True, tag=True):
    indications: tuple[Indication, ...]


class _Raised(msgspec.Struct, frozen=True, tag=True):
    what: str


_REQUEST = msgspec.msgpack.Decoder(_Reset | _Update)
_REPLY = msgspec.msgpack.Decoder(_Said | _Raised)


def _builtin(value: object) -> float:
    """A float of numpy is a float, as it is in process."""
    if isinstance(value, float):
        return float(value)
    raise TypeError(f"a {type(value).__name__} cannot be sent")


def _serve(pipe: Connection, build: Callable[[Any], Detector], config: object) -> None:
    """The child: builds the detector, then answers until the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    encode = msgspec.msgpack.encode
    try:
        detector = build(config)
        pipe.send_bytes(encode(_Said(())))
    except Exception as e:  # noqa: BLE001 # containment: the reason goes to the parent
        pipe.send_bytes(encode(_Raised(f"{type(e).__name__}: {e}")))
        return
    while True:
        try:
            request = _REQUEST.decode(pipe.recv_bytes())
        except EOFError:
            return
        try:
            if isinstance(request, _Reset):
                detector.reset(request.seed)
                reply: _Said | _Raised = _Said(())
            else:
                said = detector.update(request.now_ns, Inputs(request.latest, request.new))
                if isinstance(said, (str, bytes)) or not isinstance(said, Sequence):
                    raise TypeError(f"update() gave {type(said).__name__}, a sequence of Indication is expected")
                reply = _Said(tuple(said))
            body = encode(reply, enc_hook=_builtin)
        except Exception as e:  # noqa: BLE001 # containment, as above
            body = encode(_Raised(f"{type(e).__name__}: {e}"))
        pipe.send_bytes(body)


class ChildDetector:
    """A Detector whose work is done in a child process.

    Args:
        spec: what to build; its build must be importable by name.
        config: its settings.
        place: for error messages.
        hang_s: wall-clock time after which the child is killed.
    """

    def __init__(self, spec: DetectorSpec, config: object, place: str, hang_s: float = HANG_S) -> None:
        self._spec, self._config, self._hang_s = spec, config, hang_s
        self._context = mp.get_context("spawn")
        self._child: mp.process.BaseProcess | None = None
        self._pipe: Connection | None = None
        self._seed = 0
        try:
            self._start()
        except ChildError as e:
            if "ModuleNotFoundError" in str(e) or "ImportError" in str(e):
                hint = f"; run: pip install 'foreshock[{spec.extra}]'" if spec.extra else ""
                raise MissingExtraError(place, f"detector {spec.id!r}: {e}", hint) from e
            raise PluginError(place, f"detector {spec.id!r} cannot be built: {e}") from e

    def reset(self, seed: int) -> None:
        """Reset the detector in the child, starting one if there is none."""
        self._seed = seed
        if self._pipe is None:
            self._start()
        self._ask(_Reset(seed), self._hang_s)

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        """Update the detector in the child.

        Raises:
            ChildError: it raised, hung or died.
        """
        if self._pipe is None:
            self.reset(self._seed)
        new: Mapping[str, Sequence[Sample]] = inputs.new
        request = _Update(now_ns, dict(inputs.latest), {k: tuple(v) for k, v in new.items()})
        return self._ask(request, self._hang_s)

    def close(self) -> None:
        """End the child; idempotent."""
        if self._pipe is not None:
            self._pipe.close()
            self._pipe = None
        if self._child is not None:
            self._child.join(0.2)
            if self._child.is_alive():
                self._child.kill()
            self._child.join()
            self._child = None

    def _start(self) -> None:
        self.close()
        mine, theirs = self._context.Pipe()
        self._child = self._context.Process(
            target=_serve, args=(theirs, self._spec.build, self._config), name=f"foreshock-{self._spec.id}", daemon=True
        )
        try:
            self._child.start()
        except Exception as e:
            self._child = None
            mine.close()
            raise ChildError(f"cannot be started in a child process: {type(e).__name__}: {e}") from e
        finally:
            theirs.close()
        self._pipe = mine
        self._receive(START_S)

    def _ask(self, request: _Reset | _Update, within_s: float) -> tuple[Indication, ...]:
        assert self._pipe is not None  # noqa: S101 # _start made it
        try:
            self._pipe.send_bytes(msgspec.msgpack.encode(request))
        except OSError as e:
            raise ChildError(self._end(f"died ({e})")) from e
        return self._receive(within_s)

    def _receive(self, within_s: float) -> tuple[Indication, ...]:
        assert self._pipe is not None  # noqa: S101 # _start made it
        try:
            if not self._pipe.poll(within_s):
                raise ChildError(self._end(f"hung for {within_s:g} s"))
            reply = _REPLY.decode(self._pipe.recv_bytes())
        except (EOFError, OSError) as e:
            raise ChildError(self._end("died")) from e
        except msgspec.DecodeError as e:
            raise ChildError(f"answered what is no sequence of Indication: {e}") from e
        if isinstance(reply, _Raised):
            raise ChildError(reply.what)
        said: tuple[Indication, ...] = reply.indications
        return said

    def _end(self, how: str) -> str:
        """Kill what is left of the child; what happened, with its exit code or signal."""
        child = self._child
        if child is not None and how.startswith("died"):
            child.join(0.5)
        code = child.exitcode if child is not None else None
        if self._pipe is not None:
            self._pipe.close()
            self._pipe = None
        if child is not None:
            child.kill()
            child.join()
            self._child = None
        if code is not None and code < 0:
            how += f" by {signal.Signals(-code).name}"
        elif code is not None:
            how += f" with exit code {code}"
        return f"child process of {self._spec.id} {how}"
