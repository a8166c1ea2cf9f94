"""The builder: descriptions, units, cache, compilers."""

from __future__ import annotations

import shutil
import stat
import threading
import zipfile
from pathlib import Path

import fmpy
import pytest

import foreshock_fmus
from foreshock.errors import BadInputError, ConfigError
from foreshock_fmus import Unit, build_fmu, default_cache, find_plant, parse_unit, plants, read_plant


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("fmus")


@pytest.fixture(scope="session")
def oscillator():
    return Path(__file__).parents[1] / "twins" / "plants" / "oscillator"


@pytest.fixture
def plant(oscillator, tmp_path):
    """A copy that may be spoilt."""
    return Path(shutil.copytree(oscillator, tmp_path / "oscillator"))


@pytest.fixture
def counting_compiler(tmp_path, monkeypatch):
    """$CC that notes its calls; gives the number of compilations so far."""
    calls = tmp_path / "calls"
    script = tmp_path / "counting-cc"
    script.write_text(f'#!/bin/sh\necho "$@" >> {calls}\nexec {shutil.which("cc")} "$@"\n')
    script.chmod(script.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("CC", str(script))
    return lambda: sum("-shared" in line for line in calls.read_text().splitlines())


def test_public_names():
    assert foreshock_fmus.__all__ == sorted(foreshock_fmus.__all__)
    assert all(hasattr(foreshock_fmus, name) for name in foreshock_fmus.__all__)


def test_a_second_build_does_not_compile(plant, tmp_path, counting_compiler):
    cache = tmp_path / "cache"
    first = build_fmu(plant, 3, cache)
    assert counting_compiler() == 1
    content = first.read_bytes()
    assert build_fmu(plant, 3, cache) == first
    assert counting_compiler() == 1
    assert first.read_bytes() == content
    assert [p.name for p in cache.iterdir()] == [first.name]  # nothing temporary stays


@pytest.mark.parametrize("name", ["oscillator.c", "oscillator.toml"])
def test_a_changed_source_or_description_is_another_fmu(plant, tmp_path, name):
    first = build_fmu(plant, 3, tmp_path / "cache")
    text = (plant / name).read_text()
    (plant / name).write_text(text.replace("Damped", "Damped linear").replace("0.002", "0.003"))
    second = build_fmu(plant, 3, tmp_path / "cache")
    assert second != first
    tokens = {fmpy.read_model_description(str(p)).guid for p in (first, second)}
    assert len(tokens) == 2


def test_builders_that_race_give_one_whole_file(plant, tmp_path):
    cache, found = tmp_path / "cache", []
    threads = [threading.Thread(target=lambda: found.append(build_fmu(plant, 2, cache))) for _ in range(3)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert len(set(found)) == 1
    assert zipfile.ZipFile(found[0]).testzip() is None
    assert [p.name for p in cache.iterdir()] == [found[0].name]


def test_the_sources_in_the_fmu_build_it_again(plant, tmp_path):
    """With FMPy's own build, from sources/ and buildDescription.xml alone."""
    from fmpy.model_description import read_build_description

    fmu = build_fmu(plant, 3, tmp_path / "cache")
    (configuration,) = read_build_description(str(fmu))
    listed = set(configuration.sourceFileSets[0].sourceFiles)
    inside = {Path(n).name for n in zipfile.ZipFile(fmu).namelist() if n.startswith("sources/") and n.endswith(".c")}
    assert listed == inside == {"adapter.c", "fmi3.c", "oscillator.c", "plant_model.c"}


def test_the_adapter_compiles_without_warnings(plant, tmp_path):
    import subprocess

    for version in (2, 3):
        fmpy.extract(build_fmu(plant, version, tmp_path / "cache"), tmp_path / str(version))
        sources = tmp_path / str(version) / "sources"
        headers = Path(fmpy.__file__).parent / "c-code"
        flags = ["-std=c11", "-Wall", "-Wextra", "-Wshadow", "-Wconversion", "-Werror", "-fsyntax-only"]
        command = ["cc", *flags, f"-I{sources}", "-isystem", str(headers), *map(str, sorted(sources.glob("*.c")))]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stderr


def test_default_cache_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.setenv("FORESHOCK_CACHE", str(tmp_path))
    assert default_cache() == tmp_path / "fmus"
    monkeypatch.delenv("FORESHOCK_CACHE")
    assert default_cache().parts[-3:] == (".cache", "foreshock", "fmus")


def test_unknown_plant_names_the_nearest(monkeypatch):
    monkeypatch.setattr(foreshock_fmus._build, "plants", lambda: {"balance": Path("x")})
    with pytest.raises(BadInputError, match="no plant 'balanse'; did you mean 'balance'"):
        find_plant("balanse")


def test_shipped_plants_are_folders_with_a_description():
    for name, folder in plants().items():
        assert read_plant(folder / f"{name}.toml").id == name
        assert find_plant(name) == folder


def test_a_folder_without_description_is_no_plant(tmp_path):
    with pytest.raises(BadInputError, match="is no plant"):
        build_fmu(tmp_path)


def test_no_compiler_says_what_to_install(plant, tmp_path, monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BadInputError, match="apt install gcc"):
        build_fmu(plant, 3, tmp_path / "cache")


def test_a_wrong_cc_is_named(plant, tmp_path, monkeypatch):
    monkeypatch.setenv("CC", "/nowhere/cc")
    with pytest.raises(BadInputError, match="'/nowhere/cc' does not run"):
        build_fmu(plant, 3, tmp_path / "cache")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("return PLANT_OK;", "return PLANT_OKAY;", "PLANT_OKAY"),
        ("int plant_step", "int plant_stop", "plant_step"),  # found by the linker, not at load
        ("V_force", "V_farce", "V_farce"),
    ],
)
def test_what_the_compiler_said_is_in_the_error(plant, tmp_path, old, new, said):
    source = plant / "oscillator.c"
    source.write_text(source.read_text().replace(old, new))
    with pytest.raises(BadInputError, match=said):
        build_fmu(plant, 3, tmp_path / "cache")
    assert list((tmp_path / "cache").iterdir()) == []


def test_a_plant_may_not_replace_the_adapter(plant, tmp_path):
    (plant / "adapter.c").write_text("")
    with pytest.raises(BadInputError, match="choose another name"):
        build_fmu(plant, 3, tmp_path / "cache")


def test_fmi_version_is_2_or_3(plant):
    with pytest.raises(BadInputError, match="expected 2 or 3"):
        build_fmu(plant, 1)


MISTAKES = [
    ('id = "oscillator"', 'id = "0scillator"', "no C identifier"),
    ('id = "oscillator"', 'id = "other"', "file's name says 'oscillator'"),
    ("default_step_s = 0.001", "default_step = 0.001", "default_step_s: is missing; did you mean 'default_step'"),
    ("default_step_s = 0.001", "default_step_s = 0.0", "expected a time > 0"),
    ("default_step_s = 0.001", "default_step_s = true", "expected a number"),
    ('causality = "input"', 'causality = "inputs"', "did you mean 'input'"),
    ('name = "mass"', 'nam = "mass"', r"variables\[0\].name: is missing; did you mean 'nam'"),
    ('unit = "kg"', 'units = "kg"', "units: is not a known key; did you mean 'unit'"),
    ('unit = "kg"', 'unit = "kilos"', "'kilos' is no unit symbol"),
    ('unit = "N/m"', 'unit = "N/m/s"', "more than one '/'"),
    ("start = 2.0", 'start = "2"', "expected a finite number"),
    ("start = 2.0", "start = nan", "expected a finite number"),
    ("start = 2.0", "start = 0.0", r"outside \[0.001, inf\]"),
    ("start = 2.0", "start = [2.0, 3.0]", "expected 1, or one number"),
    ("start = 2.0\n", "", "start: is missing; every parameter needs one"),
    ("min = 0.001", "min = 5.0\nmax = 4.0", "max is 4.0"),
    ('name = "position"', 'name = "position"\nstart = 1.0', "an output is set by plant_init"),
    ('name = "spring[1..3]"', 'name = "spring[3..1]"', "empty range"),
    ('name = "spring[1..3]"', 'name = "spring[3]"', "no variable name"),
    ('name = "velocity"', 'name = "position"', "clashes with 'position'"),
    ('name = "velocity"', 'name = "joint_angle"', "clashes with"),
    ('name = "velocity"', 'name = "time"', "independent variable"),
    ("[plant]", "[plants]", "plant: is missing; did you mean 'plants'"),
    ("[plant]", "[plant", "is not TOML"),
]


@pytest.mark.parametrize(("old", "new", "said"), MISTAKES)
def test_a_wrong_description_is_refused_with_its_place(plant, old, new, said):
    path = plant / "oscillator.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ConfigError, match=said) as caught:
        read_plant(path)
    assert str(path) in str(caught.value)


def test_a_missing_description_names_its_neighbours(plant):
    with pytest.raises(ConfigError, match=r"did you mean 'oscillator\.toml'"):
        read_plant(plant / "oscilator.toml")


@pytest.mark.parametrize(
    ("text", "exponents", "factor"),
    [  # kg m s A K mol cd rad, from the definition of each unit
        ("1", (0, 0, 0, 0, 0, 0, 0, 0), 1.0),
        ("N.m/rad", (1, 2, -2, 0, 0, 0, 0, -1), 1.0),
        ("kg.m2/s2", (1, 2, -2, 0, 0, 0, 0, 0), 1.0),
        ("m/s^2", (0, 1, -2, 0, 0, 0, 0, 0), 1.0),
        ("1/s", (0, 0, -1, 0, 0, 0, 0, 0), 1.0),
        ("N/(m.s)", (1, 0, -3, 0, 0, 0, 0, 0), 1.0),
        ("mm2", (0, 2, 0, 0, 0, 0, 0, 0), 1e-6),
        ("deg/s", (0, 0, -1, 0, 0, 0, 0, 1), 0.017453292519943295),
    ],
)
def test_units(text, exponents, factor):
    unit = parse_unit(text)
    assert unit.exponents == exponents
    assert unit.factor == pytest.approx(factor, rel=1e-12)
    assert unit.same(Unit(exponents, factor))


def test_units_reach_the_model_description(oscillator, cache):
    for version in (2, 3):
        description = fmpy.read_model_description(str(build_fmu(oscillator, version, cache)))
        base = {u.name: u.baseUnit for u in description.unitDefinitions}["N.m"]
        assert (base.kg, base.m, base.s, base.rad, base.factor) == (1, 2, -2, 0, 1.0)
        assert {v.name: v.unit for v in description.modelVariables}["spring[2]"] == "N"
        assert float(description.defaultExperiment.stepSize) == 0.001
        assert description.coSimulation.modelIdentifier == "oscillator"
