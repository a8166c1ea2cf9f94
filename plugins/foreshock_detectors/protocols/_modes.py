"""The protocol of each accident mode: cheap and reversible actions at the caution gate, protective ones at T < 0.3."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

__all__ = ["PROTOCOLS", "Protocol"]


class Protocol(msgspec.Struct, frozen=True):
    """Actions at the caution gate, and those at the protective gate, which replace them."""

    caution: tuple[str, ...]
    protective: tuple[str, ...]


PAPER = ("step-suppression", "arm-reconfiguration", "compliance-tuning", "balance-lock")

PROTOCOLS: Mapping[str, Protocol] = {
    "A1": Protocol(("step-suppression",), (*PAPER, "impact-mitigation")),
    "A2": Protocol(("soften-arms",), ("soften-arms", "withdraw-arm")),
    "A3": Protocol(("shorten-step", "announce"), ("step-suppression", "announce")),
    "A4": Protocol(("hold",), ("release", "retreat")),
    "A5": Protocol(("regrasp",), ("regrasp", "lower-load")),
    "A6": Protocol(("slow-approach", "announce"), ("protective-stop", "announce")),
    "A7": Protocol(("slow-approach", "announce"), ("hold", "announce")),
    "A8": Protocol(("slow-approach",), ("hold", "announce")),
    "A9": Protocol(("derate",), ("protective-stop", "brake-joints")),
    "A10": Protocol(("hold",), ("tool-off", "reorient-tool", "hold")),
    "A11": Protocol(("slow-approach", "regrasp"), ("regrasp", "hold", "lower-load")),
    "A12": Protocol(("announce",), ("protective-stop", "announce")),
}
