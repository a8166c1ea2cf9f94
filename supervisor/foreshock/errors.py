"""Errors: one root; each carries what was wrong, what was expected and where to look."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

__all__ = [
    "BadInputError",
    "ConfigError",
    "ForeshockError",
    "MissingExtraError",
    "NoOpenGLError",
    "PluginError",
    "TwinError",
    "WireError",
    "nearest",
]


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint naming the known names closest to a wrong one, e.g. ``"; did you mean 'balance'?"``; may be empty."""
    names = sorted(set(known))
    close = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    if close:
        return "; did you mean " + " or ".join(repr(c) for c in close) + "?"
    if 0 < len(names) <= 20:
        return "; known: " + ", ".join(names)
    return ""


class ForeshockError(Exception):
    """Root of every error that Foreshock raises."""


class BadInputError(ForeshockError):
    """Something that a user supplied is wrong.

    Args:
        place: where it stands: a file, a key path, a variable name.
        problem: what is wrong there, with the offending value.
        hint: what was expected, or the nearest right name.
    """

    def __init__(self, place: str, problem: str, hint: str = "") -> None:
        super().__init__(place, problem, hint)
        self.place, self.problem, self.hint = place, problem, hint

    def __str__(self) -> str:
        return f"{self.place}: {self.problem}{self.hint}"


class ConfigError(BadInputError):
    """A configuration, scenario, taxonomy or binding file does not hold what it must."""


class PluginError(BadInputError):
    """A plugin breaks the contract of its port."""


class MissingExtraError(BadInputError):
    """A plugin needs a package that is not installed; the hint is the command that installs it."""


class WireError(BadInputError):
    """A payload, an attachment or a key that came over the wire is not what its type or key says."""


class NoOpenGLError(ForeshockError):
    """Pictures cannot be drawn here; what each OpenGL backend said. Who only wants pictures too goes on without."""

    def __str__(self) -> str:
        return (
            f"no pictures: no OpenGL is to be had here ({self.args[0]}); MUJOCO_GL names a backend: egl, osmesa, glfw"
        )


class TwinError(ForeshockError):
    """A twin failed while running.

    Args:
        kind: ``error`` (the model said so), ``discard`` (it refused the step), ``nan``, ``hang``, ``crash``.
        detail: what the twin or the operating system said.
        log: the twin's own last words, if any.
    """

    def __init__(self, kind: str, detail: str, log: str = "") -> None:
        super().__init__(kind, detail, log)
        self.kind, self.detail, self.log = kind, detail, log

    def __str__(self) -> str:
        tail = f"\n--- log of the twin ---\n{self.log}" if self.log else ""
        return f"twin {self.kind}: {self.detail}{tail}"
