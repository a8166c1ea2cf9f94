"""The C compiler at hand: $CC, cc, gcc, clang, or the one that the ziglang wheel brings."""

from __future__ import annotations

import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import msgspec

from foreshock.errors import BadInputError

__all__ = ["FLAGS", "Compiler", "compile_library", "find_compiler"]

# No contraction to fused multiply-add: the same plant gives the same samples on every machine of one architecture.
FLAGS = ("-std=c11", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden", "-Wall", "-Wextra")


class Compiler(msgspec.Struct, frozen=True):
    """A compiler: how it is called, and what it says its version is."""

    command: tuple[str, ...]
    version: str


def find_compiler() -> Compiler:
    """The first that runs, of $CC, cc, gcc, clang, ziglang.

    Raises:
        BadInputError: none is installed, or $CC does not run.
    """
    return _find(os.environ.get("CC", ""), os.environ.get("PATH", ""))


@cache
def _find(cc: str, path: str) -> Compiler:
    if cc:
        compiler = _probe(tuple(shlex.split(cc)))
        if compiler is None:
            raise BadInputError("$CC", f"{cc!r} does not run")
        return compiler
    for name in ("cc", "gcc", "clang"):
        found = shutil.which(name, path=path)
        compiler = _probe((found,)) if found else None
        if compiler is not None:
            return compiler
    if importlib.util.find_spec("ziglang") is not None:
        compiler = _probe((sys.executable, "-m", "ziglang", "cc"))
        if compiler is not None:
            return compiler
    hint = "; on Debian and Ubuntu: apt install gcc libc6-dev; elsewhere: pip install ziglang"
    raise BadInputError("C compiler", "there is none (tried $CC, cc, gcc, clang, ziglang)", hint)


def _probe(command: tuple[str, ...]) -> Compiler | None:
    try:
        result = subprocess.run(  # noqa: S603 - the user's own compiler, no shell
            [*command, "--version"], capture_output=True, text=True, check=False, timeout=60.0
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    lines = result.stdout.splitlines()
    return Compiler(command, lines[0] if lines else "") if result.returncode == 0 else None


def compile_library(
    compiler: Compiler, sources: Sequence[Path], include: Sequence[Path], defines: Mapping[str, str], output: Path
) -> None:
    """Compile C files into one shared library.

    Raises:
        BadInputError: with what the compiler said.
    """
    # So that a missing plant_step fails here, not at load.
    undefined = ("-Wl,--no-undefined",) if platform.system() == "Linux" else ()
    command = [
        *compiler.command,
        *FLAGS,
        *(f"-D{name}={value}" for name, value in defines.items()),
        *(f"-I{folder}" for folder in include),
        *(str(source) for source in sources),
        *undefined,
        "-lm",
        "-o",
        str(output),
    ]
    result = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - as above
    if result.returncode != 0:
        names = " ".join(source.name for source in sources)
        raise BadInputError(names, "does not compile", f":\n{result.stderr.strip()}")
