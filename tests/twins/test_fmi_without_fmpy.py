"""FMPy missing or broken: one error with the command that helps, and nothing is built."""

from __future__ import annotations

import sys

import pytest

from foreshock.errors import MissingExtraError

SOURCES = {
    "no compiled part": "raise ImportError('libsundials.so: cannot open shared object file')",
    "a package it needs": "import a_package_that_nobody_installed",
    "cut short": "",  # the package is there, its modules are not
}


@pytest.fixture
def fresh(monkeypatch):
    """An interpreter that has not imported FMPy; what the other tests imported comes back afterwards."""
    for name in [n for n in sys.modules if n.partition(".")[0] == "fmpy"]:
        monkeypatch.delitem(sys.modules, name)
    yield monkeypatch
    for name in [n for n in sys.modules if n.partition(".")[0] == "fmpy"]:
        del sys.modules[name]


def refused(make_twin, fmu_cache):
    """The error of a build; it must have built nothing."""
    before = sorted(fmu_cache.rglob("*"))
    with pytest.raises(MissingExtraError) as caught:
        make_twin(plant="balance")
    assert sorted(fmu_cache.rglob("*")) == before
    assert caught.value.place == "twin fmu"
    assert caught.value.problem.startswith("needs fmpy")
    assert caught.value.hint == "; run: pip install 'foreshock[fmi]'"
    return caught.value


def test_no_fmpy(fresh, make_twin, fmu_cache):
    fresh.setitem(sys.modules, "fmpy", None)  # how Python marks a module that cannot be imported
    refused(make_twin, fmu_cache)


@pytest.mark.parametrize("source", SOURCES.values(), ids=SOURCES)
def test_an_fmpy_that_is_found_but_does_not_import(fresh, make_twin, fmu_cache, tmp_path, source):
    package = tmp_path / "site" / "fmpy"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(source)
    fresh.syspath_prepend(str(tmp_path / "site"))
    error = refused(make_twin, fmu_cache)
    assert isinstance(error.__cause__, ImportError)
    assert str(error.__cause__) in error.problem
