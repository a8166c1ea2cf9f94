"""The hook specification, on one page. Hooks serve set-up alone; the hot path is a plain method call.

A plugin is a module reached by an entry point of group ``foreshock``. It implements any of the functions below, marked
with ``@hookimpl``. Its import must be cheap: heavy packages are imported in a spec's ``build``.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pluggy

from foreshock.detector import DetectorSpec
from foreshock.policy import PolicySpec
from foreshock.taxonomy import PrecursorKind
from foreshock.twin import TwinSpec

__all__ = ["GROUP", "hookimpl"]

GROUP = "foreshock"
hookspec = pluggy.HookspecMarker(GROUP)
hookimpl = pluggy.HookimplMarker(GROUP)


@hookspec
def foreshock_detectors() -> Sequence[DetectorSpec]:  # type: ignore[empty-body]  # pluggy: a specification has no body
    """Detectors that this plugin offers."""


@hookspec
def foreshock_precursors() -> Sequence[PrecursorKind]:  # type: ignore[empty-body]  # as above
    """Precursor kinds that extend the taxonomy."""


@hookspec
def foreshock_policies() -> Sequence[PolicySpec]:  # type: ignore[empty-body]  # as above
    """Intervention policies that this plugin offers."""


@hookspec
def foreshock_twins() -> Sequence[TwinSpec]:  # type: ignore[empty-body]  # as above
    """Kinds of twin that this plugin offers."""


@hookspec
def foreshock_scenarios() -> Sequence[Path]:  # type: ignore[empty-body]  # as above
    """Scenario files (TOML) that this plugin ships."""
