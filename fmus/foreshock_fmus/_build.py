"""From a plant's folder to an FMU file, compiled on first use and cached by content."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import sys
import tempfile
import uuid
import zipfile
from pathlib import Path

from foreshock.errors import BadInputError, MissingExtraError, nearest
from foreshock_fmus._c_source import model_source, variables_header
from foreshock_fmus._compiler import FLAGS, Compiler, compile_library, find_compiler
from foreshock_fmus._description import PlantDescription, read_plant
from foreshock_fmus._model_description import DEFINITIONS, build_description, model_description

__all__ = ["build_fmu", "default_cache", "find_plant", "plants"]

_HERE = Path(__file__).parent
_ADAPTER = _HERE / "adapter"
_COMMON = _HERE / "common"
_EPOCH = (1980, 1, 1, 0, 0, 0)  # equal content gives equal bytes
_SUFFIX = {"Linux": ".so", "Darwin": ".dylib", "Windows": ".dll"}


def plants() -> dict[str, Path]:
    """The plants that come with this package: name to folder, sorted."""
    return {p.name: p for p in sorted((_HERE / "plants").glob("*")) if (p / f"{p.name}.toml").is_file()}


def find_plant(plant: str | Path) -> Path:
    """The folder of a plant, by its name or by its path.

    Raises:
        BadInputError: there is no such plant.
    """
    known = plants()
    if isinstance(plant, str) and plant in known:
        return known[plant]
    folder = Path(plant)
    if (folder / f"{folder.resolve().name}.toml").is_file():
        return folder.resolve()
    if folder.is_dir():
        name = folder.resolve().name
        raise BadInputError(str(folder), "is no plant", f"; a plant's folder holds {name}.toml and its C files")
    raise BadInputError("plant", f"there is no plant {str(plant)!r}", nearest(str(plant), known))


def default_cache() -> Path:
    """Where built FMUs are kept: ``$FORESHOCK_CACHE/fmus`` or ``~/.cache/foreshock/fmus``."""
    root = os.environ.get("FORESHOCK_CACHE", "")
    return (Path(root) if root else Path.home() / ".cache" / "foreshock") / "fmus"


def build_fmu(plant: str | Path, fmi_version: int = 3, cache: Path | None = None) -> Path:
    """The FMU of a plant, built if the cache does not hold it.

    The cache key is a hash over the description, all sources, the flags and the compiler's version. Any number of
    processes may build at once: the file appears whole, by one rename.

    Args:
        plant: the name of a plant of this package, or a folder with ``<name>.toml`` and C files.
        fmi_version: 2 or 3.
        cache: folder for built FMUs; default_cache() if None.

    Raises:
        BadInputError: unknown plant, no compiler, or the plant does not compile.
        ConfigError: the description is wrong.
        MissingExtraError: the FMI headers are missing; they come with FMPy.
    """
    if fmi_version not in (2, 3):
        raise BadInputError("fmi_version", f"is {fmi_version!r}", "; expected 2 or 3")
    folder = find_plant(plant)
    description = read_plant(folder / f"{folder.name}.toml")
    files = _files(description, _sources(folder), fmi_version)
    compiler, headers = find_compiler(), _fmi_headers()
    content = repr((fmi_version, FLAGS, compiler, sorted(files.items()))).encode()
    key = hashlib.sha256(content).hexdigest()[:20]
    target = (default_cache() if cache is None else cache) / f"{description.id}-fmi{fmi_version}-{key}.fmu"
    if not target.is_file():
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".build-", dir=target.parent) as scratch:
            _package(Path(scratch), description.id, fmi_version, files, compiler, headers).replace(target)
    return target


def _sources(folder: Path) -> dict[str, bytes]:
    """All C files of the plant, the headers that plants share, and what both FMI versions share of the adapter."""
    own = {p.name: p.read_bytes() for p in sorted(folder.glob("*.[ch]"))}
    if not any(name.endswith(".c") for name in own):
        raise BadInputError(str(folder), "holds no C file", f"; expected {folder.name}.c")
    parts = (*(_ADAPTER / n for n in ("adapter.c", "adapter.h", "plant.h")), *sorted(_COMMON.glob("*.h")))
    shared = {p.name: p.read_bytes() for p in parts}
    for name in own:
        if name in shared or name in ("fmi2.c", "fmi3.c", "plant_vars.h", "plant_model.c"):
            raise BadInputError(
                str(folder / name), "has the name of a file of the adapter or of common/", "; choose another name"
            )
    return own | shared


def _token(description: PlantDescription, sources: dict[str, bytes]) -> str:
    digest = hashlib.sha256(repr((description, sorted(sources.items()))).encode()).digest()
    return "{" + str(uuid.UUID(bytes=digest[:16])) + "}"


def _fmi_headers() -> Path:
    spec = importlib.util.find_spec("fmpy")
    if spec is None or spec.origin is None:
        raise MissingExtraError("FMI headers", "FMPy is not installed", '; pip install "foreshock[fmi]"')
    return Path(spec.origin).parent / "c-code"


def _files(description: PlantDescription, sources: dict[str, bytes], fmi_version: int) -> dict[str, bytes]:
    """Every file of the FMU but the binary, by its path in the archive."""
    token = _token(description, sources)
    sources = sources | {
        "plant_vars.h": variables_header(description).encode(),
        "plant_model.c": model_source(description, token).encode(),
        f"fmi{fmi_version}.c": (_ADAPTER / f"fmi{fmi_version}.c").read_bytes(),
    }
    names = sorted(name for name in sources if name.endswith(".c"))
    files = {f"sources/{name}": content for name, content in sources.items()}
    if fmi_version == 3:
        files["sources/buildDescription.xml"] = build_description(description, names)
    files["modelDescription.xml"] = model_description(description, fmi_version, token, names)
    return files


def _package(
    scratch: Path, identifier: str, fmi_version: int, files: dict[str, bytes], compiler: Compiler, headers: Path
) -> Path:
    """Compile and zip inside scratch; the finished file's path."""
    folder = scratch / "sources"
    folder.mkdir()
    for name, content in files.items():
        if name.startswith("sources/"):
            (scratch / name).write_bytes(content)
    library = scratch / f"{identifier}{_SUFFIX[platform.system()]}"
    compile_library(compiler, sorted(folder.glob("*.c")), [folder, headers], DEFINITIONS, library)
    files = files | {f"binaries/{_platform(fmi_version)}/{library.name}": library.read_bytes()}
    built = scratch / "built.fmu"
    with zipfile.ZipFile(built, "w") as archive:
        for name in sorted(files):
            archive.writestr(zipfile.ZipInfo(name, _EPOCH), files[name], zipfile.ZIP_DEFLATED)
    return built


def _platform(fmi_version: int) -> str:
    """Folder of the binary: FMI 2.0.4, 2.3 and FMI 3.0, 2.5.1.4."""
    system = platform.system().lower()
    if fmi_version == 2:
        bits = "64" if sys.maxsize > 2**32 else "32"
        return {"windows": "win"}.get(system, system) + bits
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    return f"{machine}-{system}"
