"""Writes a plugin project from the templates in foreshock/data/templates/detector."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from string import Template

from foreshock.errors import ConfigError
from foreshock.taxonomy import builtin_taxonomy
from foreshock.testing.spec_checks import KEBAB

__all__ = ["write_project"]

FILES = {
    "pyproject.toml": "pyproject.toml.tmpl",
    "README.md": "README.md.tmpl",
    "src/$package/__init__.py": "init.py.tmpl",
    "src/$package/_detector.py": "detector.py.tmpl",
    "src/$package/py.typed": "",
    "tests/test_$module.py": "test.py.tmpl",
}
EXPORTS = '"SPEC", "foreshock_detectors"'
OWN_EXPORTS = '"KIND", "SPEC", "foreshock_detectors", "foreshock_precursors"'
OWN_KIND = """


@hookimpl
def foreshock_precursors() -> Sequence[PrecursorKind]:
    \"\"\"The kind that this plugin adds to the taxonomy.\"\"\"
    return (KIND,)"""


def write_project(name: str, kind: str | None, folder: Path, taken: Iterable[str]) -> tuple[Path, ...]:
    """The files that were written.

    Args:
        name: id of the detector.
        kind: taxonomy id that it reports; None makes one of its own, called like the detector.
        folder: where the project goes; it must not exist, or be empty.
        taken: names of the installed plugins.

    Raises:
        ConfigError: the name does not fit or is taken, or the folder holds something.
    """
    package = f"foreshock_{name.replace('-', '_')}"
    _refuse(name, package, kind, folder.resolve(), set(taken))
    own = kind is None
    id_ = name if kind is None else kind
    words = {
        "name": name,
        "title": name.replace("-", " ").capitalize(),
        "words": name.replace("-", " "),
        "class_name": "".join(w.capitalize() for w in name.split("-")),
        "package": package,
        "module": name.replace("-", "_"),
        "kind": id_,
        "version": version("foreshock"),
        "exports": OWN_EXPORTS if own else EXPORTS,
        "own_import": "from foreshock.taxonomy import PrecursorKind\n" if own else "",
        "own_constant": _constant(id_) if own else "",
        "own_hook": OWN_KIND if own else "",
        "test_import": f"from {package} import {'KIND, ' if own else ''}SPEC",
        "test_precursors": "    precursors = (KIND,)\n" if own else "",
        "test_rig": ", precursors=(KIND,)" if own else "",
        "about_kind": _about(id_, own),
    }
    templates = files("foreshock").joinpath("data/templates/detector")
    texts = {
        folder / Template(path).substitute(words): Template(
            templates.joinpath(source).read_text(encoding="utf-8") if source else ""
        ).substitute(words)
        for path, source in FILES.items()
    }
    for path, text in texts.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return tuple(texts)


def _refuse(name: str, package: str, kind: str | None, folder: Path, taken: set[str]) -> None:
    if not KEBAB.fullmatch(name):
        raise ConfigError("NAME", f"{name!r} is not lower-case words joined by hyphens", "; for example: hot-motor")
    if name.startswith("foreshock"):
        raise ConfigError("NAME", f"{name!r} begins with foreshock", "; the distribution gets that prefix anyway")
    if name in taken:
        raise ConfigError("NAME", f"{name!r} is taken by an installed plugin")
    if importlib.util.find_spec(package) is not None:
        raise ConfigError("NAME", f"the package {package} exists already")
    if kind is None and name in {n for k in builtin_taxonomy().kinds for n in (k.id, *k.aliases)}:
        raise ConfigError("NAME", f"the taxonomy has a kind {name!r} already", f"; report it: --kind {name}")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ConfigError(str(folder), "exists already and is not an empty folder", "; choose another with --dir")


def _constant(id_: str) -> str:
    title = id_.replace("-", " ").capitalize()
    return f"""
KIND = PrecursorKind(
    id="{id_}",
    title="{title}",
    class_="system-telemetry",
    source="TODO: the paper, standard or data sheet that ties it to accidents",
)
"""


def _about(id_: str, own: bool) -> str:
    if not own:
        return f"It reports the kind `{id_}` of the taxonomy (`foreshock taxonomy show`)."
    return (
        f"It adds the kind `{id_}` to the taxonomy, in class system-telemetry, which ties it to\n"
        "the accident modes of that class. Choose the class that fits and write down the source."
    )
