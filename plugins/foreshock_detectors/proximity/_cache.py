"""Capsules on disk, by what they were computed from. A file that is torn or altered is fitted anew, never trusted."""

from __future__ import annotations

import hashlib
import math
import os
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import msgspec

from foreshock_detectors.proximity._bodies import BodyCapsule

__all__ = ["ALGORITHM", "cached", "content_digest"]

ALGORITHM = "foreshock-capsules-1"
"""Changes with every change of the fit that changes its result."""


class _Stored(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a file holds: the digest of the inputs, the capsules, and a checksum of both."""

    inputs: str
    capsules: tuple[BodyCapsule, ...]
    checksum: str


def content_digest(files: Iterable[Path], *parameters: object) -> str:
    """SHA-256 over the algorithm's version, the parameters and the bytes of every file, each with its length."""
    digest = hashlib.sha256(f"{ALGORITHM} {parameters!r}".encode())
    for path in files:
        data = path.read_bytes()
        digest.update(f"\n{len(data)}\n".encode())
        digest.update(data)
    return digest.hexdigest()


def cached(folder: Path | None, inputs: str, fit: Callable[[], Sequence[BodyCapsule]]) -> tuple[BodyCapsule, ...]:
    """The capsules of these inputs: read if they are there and whole, else fitted and stored.

    Args:
        folder: of the cache; None fits every time.
        inputs: digest of everything that the fit depends on.
        fit: computes them.
    """
    path = folder / f"{inputs}.json" if folder is not None else None
    if path is not None and (stored := _read(path, inputs)) is not None:
        return stored
    capsules = tuple(fit())
    if path is not None:
        _write(path, msgspec.json.encode(_Stored(inputs, capsules, _checksum(inputs, capsules))))
    return capsules


def _read(path: Path, inputs: str) -> tuple[BodyCapsule, ...] | None:
    try:
        stored = msgspec.json.decode(path.read_bytes(), type=_Stored)
    except (OSError, msgspec.DecodeError, UnicodeDecodeError):
        return None
    if stored.inputs != inputs or stored.checksum != _checksum(inputs, stored.capsules) or not stored.capsules:
        return None
    if not all(math.isfinite(math.fsum((*c.a, *c.b))) and 0.0 < c.radius < math.inf for c in stored.capsules):
        return None
    return stored.capsules


def _write(path: Path, data: bytes) -> None:
    """Atomically: a reader sees the whole file or none, whatever else writes it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=path.stem[:16], suffix=".tmp")
    except OSError:
        return  # a cache that cannot be written costs a fit at the next start, and nothing else
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(handle)
        Path(name).replace(path)
    except OSError:
        Path(name).unlink(missing_ok=True)


def _checksum(inputs: str, capsules: tuple[BodyCapsule, ...]) -> str:
    return hashlib.sha256(inputs.encode() + msgspec.json.encode(capsules)).hexdigest()
