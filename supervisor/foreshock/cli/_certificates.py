"""Certificates of a link as ``foreshock doctor`` sees them: there, valid, of the authority, with their key."""

from __future__ import annotations

import ssl
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from foreshock.cli._finding import Finding
from foreshock.clock import NS_PER_S, wall_ns
from foreshock.link import LinkSettings, TlsSettings

if TYPE_CHECKING:
    from cryptography import x509

__all__ = ["certificates", "common_name"]

FLIGHTS = 4
"""Turns of each side until both have verified the other: one more than TLS 1.2 takes."""


def certificates(link: LinkSettings, base: Path) -> Iterator[Finding]:
    """What there is to say of the authority and this process's certificate."""
    if not link.tls.ca:
        remote = link.remote
        yield Finding("certificates", False if remote else None, "none: anybody on this link may write anything")
        return
    refused = _refused(link.tls, base)
    for what, name in (("authority", link.tls.ca), ("certificate", link.tls.certificate)):
        path = base / name
        if not path.is_file():
            yield Finding(what, False, f"there is no file {str(path)!r}; foreshock security init makes one")
            continue
        try:
            certificate = _first(path)
        except ValueError as e:
            yield Finding(what, False, f"{path}: {e}")
            continue
        left = (certificate.not_valid_after_utc.timestamp() - wall_ns() / NS_PER_S) / 86400.0
        said = f"{certificate.subject.rfc4514_string()}, valid for {left:.0f} days"
        if what == "authority":
            yield Finding(what, left > 0.0, said if left > 0.0 else f"{path}: has expired")
        else:
            yield Finding(what, not refused, refused or said)


def common_name(link: LinkSettings, base: Path) -> str:
    """The name in this process's certificate, by which access rules know it; empty if there is none.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no certificate.
    """
    from cryptography.x509 import NameOID

    names = _first(base / link.tls.certificate).subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if names else ""


def _first(path: Path) -> x509.Certificate:
    from cryptography import x509

    return x509.load_pem_x509_certificate(path.read_bytes())


def _refused(tls: TlsSettings, base: Path) -> str:
    """Why a peer that trusts the authority would refuse this certificate; empty if it would not.

    A handshake in memory between two sides that both show it: chain, dates, purposes and key are OpenSSL's to judge.
    """
    ca, certificate, key = (base / name for name in (tls.ca, tls.certificate, tls.key))
    server, client = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER), ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    client.check_hostname = False
    for path in (ca, certificate, key):
        if not path.is_file():
            return f"there is no file {str(path)!r}; foreshock security init makes one"
    for context in (server, client):
        context.verify_mode = ssl.CERT_REQUIRED
        try:
            context.load_verify_locations(ca)
        except OSError as e:  # which an SSLError is
            return f"{ca}: {e.strerror or e}"
        try:
            context.load_cert_chain(certificate, key, password="")
        except OSError as e:
            return f"{certificate} and {key} do not go together: {e.strerror or e}"
    forth, back = ssl.MemoryBIO(), ssl.MemoryBIO()
    sides = (client.wrap_bio(back, forth), server.wrap_bio(forth, back, server_side=True))
    try:
        for side in sides * FLIGHTS:
            with suppress(ssl.SSLWantReadError):
                side.do_handshake()
    except ssl.SSLCertVerificationError as e:
        return f"{certificate} is not valid under {ca}: {e.verify_message}"
    except ssl.SSLError as e:
        return f"{certificate}: {e.strerror or e}"
    return ""
