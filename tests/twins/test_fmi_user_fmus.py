"""FMUs that others made: several types, aliases of units, arrays, fixed steps, broken packages."""

from __future__ import annotations

import platform
import subprocess
import textwrap
import zipfile
from pathlib import Path

import fmpy
import pytest

from foreshock.errors import ConfigError, TwinError
from foreshock.messages import GripState, Heartbeat, Scalar
from foreshock.records import Intervention

HERE = Path(__file__).parent / "mixed"
HEADERS = Path(fmpy.__file__).parent / "c-code"
MS = 1_000_000
LIBRARY_FOLDER = {2: "linux64", 3: f"{platform.machine()}-linux"}  # as the standard of each names it
BINDING = """
[binding]
step_s = 0.01
[[channels]]
name = "gripper/state"
type = "GripState"
period_s = 0.01
fields = { grasping = "closed", normal_force = "force", tangential_force = 0, opening = 0, commanded_force = 0 }
[[channels]]
name = "control/beat"
type = "Heartbeat"
period_s = 0.01
fields = { sequence = "count" }
[[channels]]
name = "gripper/mode"
type = "Scalar"
period_s = 0.02
fields = { data = "level" }
[[interventions]]
action = "open"
inputs = { enable = 0, gain = 7 }
[[events]]
id = "closed"
when = [{ variable = "closed", above = 0.5 }, { variable = "count", above = 4.5 }]
value = "count"
limit = 4
[probes]
small = "small"
count = "count"
"""


@pytest.fixture(scope="session")
def build_mixed(tmp_path_factory):
    """Compiles the hand-written FMU of tests/twins/mixed; gives a function of version and changes to its XML."""
    work = tmp_path_factory.mktemp("mixed")

    def build(version, *changes, binary=True, content=None):
        library = work / f"fmi{version}.so"
        if not library.exists():
            flags = ["-shared", "-fPIC", "-O1", "-Wall", "-Werror", f"-I{HEADERS}"]
            subprocess.run(["cc", *flags, str(HERE / f"mixed{version}.c"), "-o", str(library)], check=True)
        xml = (HERE / f"mixed{version}.xml").read_text()
        for old, new in changes:
            assert old in xml
            xml = xml.replace(old, new)
        fmu = work / f"mixed{version}-{abs(hash((changes, binary, content)))}.fmu"
        where = LIBRARY_FOLDER[version]
        with zipfile.ZipFile(fmu, "w") as archive:
            archive.writestr("modelDescription.xml", xml)
            if content is not None:
                archive.writestr(f"binaries/{where}/mixed.so", content)
            elif binary:
                archive.write(library, f"binaries/{where}/mixed.so")
            else:
                archive.writestr("binaries/win64/mixed.dll", b"")
        return str(fmu)

    return build


@pytest.fixture(scope="session")
def bare_library(tmp_path_factory):
    """A shared library that loads, with no function of FMI in it."""
    folder = tmp_path_factory.mktemp("bare")
    (folder / "bare.c").write_text("int nothing(void) { return 0; }\n")
    subprocess.run(["cc", "-shared", "-fPIC", str(folder / "bare.c"), "-o", str(folder / "bare.so")], check=True)
    return (folder / "bare.so").read_bytes()


@pytest.fixture
def binding(tmp_path):
    path = tmp_path / "mixed.toml"
    path.write_text(BINDING)
    return str(path)


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def mixed(request, build_mixed, make_twin, binding):
    return make_twin(fmu=build_mixed(request.param), binding=binding)


def test_integers_booleans_and_enumerations_become_fields(mixed):
    """The plant: count grows by gain while enabled, force is count / 4, closed above 2, level is 1 below 3, else 2."""
    mixed.reset({}, 0)
    samples = mixed.advance(60 * MS)
    grips = [s.value for s in samples if isinstance(s.value, GripState)]
    assert [g.normal_force for g in grips] == [0.25, 0.5, 0.75, 1.0, 1.25, 1.5]
    assert [g.grasping for g in grips] == [False, False, True, True, True, True]
    beats = [s.value for s in samples if isinstance(s.value, Heartbeat)]
    assert [b.sequence for b in beats] == [1, 2, 3, 4, 5, 6]
    assert all(type(b.sequence) is int for b in beats)
    assert [s.value.data for s in samples if isinstance(s.value, Scalar)] == [1.0, 2.0, 2.0]
    assert mixed.probes() == {"small": pytest.approx(0.1, abs=1e-8), "count": 6.0}
    (event,) = mixed.events()
    assert (event.stamp_ns, event.value) == (50 * MS, 6.0)


def test_integer_and_boolean_parameters_and_inputs_are_set(mixed):
    mixed.reset({"offset": 10, "inverted": 1.0}, 0)
    grip = next(s.value for s in mixed.advance(10 * MS) if isinstance(s.value, GripState))
    assert (grip.normal_force, grip.grasping) == (2.75, False)  # count 11; closed is inverted
    mixed.intervene(Intervention(0, "open", 1.0))  # enable is off: the count stands still
    assert [s.value.sequence for s in mixed.advance(30 * MS) if isinstance(s.value, Heartbeat)] == [11, 11]
    mixed.intervene(Intervention(0, "open", 0.0))
    assert [s.value.sequence for s in mixed.advance(40 * MS) if isinstance(s.value, Heartbeat)] == [12]


@pytest.mark.parametrize("version", [2, 3])
def test_text_cannot_be_bound(build_mixed, make_twin, tmp_path, version):
    path = tmp_path / "text.toml"
    path.write_text('[binding]\nstep_s = 0.01\n[probes]\nx = "label"\n')
    with pytest.raises(ConfigError, match="variable 'label' is of type String"):
        make_twin(fmu=build_mixed(version), binding=str(path))


def test_an_array_cannot_be_bound(build_mixed, make_twin, tmp_path):
    path = tmp_path / "array.toml"
    path.write_text('[binding]\nstep_s = 0.01\n[probes]\nx = "row"\n')
    with pytest.raises(ConfigError, match=r"variable 'row' is an array of shape \(3,\)"):
        make_twin(fmu=build_mixed(3), binding=str(path))


def test_units_are_compared_by_meaning(build_mixed, make_twin, binding):
    """A unit of another name counts by its definition; another factor is refused; one without definition as well."""
    kgms = ('<Unit name="N">', '<Unit name="kg.m.s-2">'), ('unit="N"', 'unit="kg.m.s-2"')
    make_twin(fmu=build_mixed(2, *kgms), binding=binding)
    kilo = ('<BaseUnit kg="1" m="1" s="-2"/>', '<BaseUnit kg="1" m="1" s="-2" factor="1000.0"/>')
    with pytest.raises(ConfigError, match=r"variable 'force' is in 'N'; GripState\.normal_force is in 'N'"):
        make_twin(fmu=build_mixed(2, kilo), binding=binding)
    unknown = (
        ('<Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit>', '<Unit name="pull"/>'),
        ('unit="N"', 'unit="pull"'),
    )
    with pytest.raises(ConfigError, match="is in 'pull'"):
        make_twin(fmu=build_mixed(2, *unknown), binding=binding)


def test_a_fixed_internal_step_is_respected(build_mixed, make_twin, binding):
    fixed = ('modelIdentifier="mixed"', 'modelIdentifier="mixed" fixedInternalStepSize="0.004"')
    with pytest.raises(ConfigError, match=r"step_s: is 0.01 s; expected a multiple of the FMU's own step, 0.004 s"):
        make_twin(fmu=build_mixed(3, fixed), binding=binding)
    make_twin(fmu=build_mixed(3, (fixed[0], fixed[1].replace("0.004", "0.005"))), binding=binding)


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_for_other_platforms_says_which(build_mixed, make_twin, binding, version):
    before = Path.cwd()
    fmu = build_mixed(version, binary=False)
    with pytest.raises(ConfigError, match="it holds binaries for win64") as caught:
        make_twin(fmu=fmu, binding=binding)
    assert Path.cwd() == before
    assert caught.value.place == fmu
    assert f" binaries/{LIBRARY_FOLDER[version]}/mixed.so" in caught.value.problem  # not where it was extracted


@pytest.mark.parametrize(
    "content", [b"", b"\x7fELF, or so it says", "no functions"], ids=["empty", "cut", "no-functions"]
)
@pytest.mark.parametrize("version", [2, 3])
def test_a_broken_library_is_named_as_the_user_knows_it(
    build_mixed, make_twin, tmp_path, binding, version, content, bare_library
):
    """The file that the user gave and the library's path inside it; the scratch folder means nothing to the user."""
    fmu = build_mixed(version, content=bare_library if content == "no functions" else content)
    before = Path.cwd()
    with pytest.raises(ConfigError) as caught:
        make_twin(fmu=fmu, binding=binding)
    assert Path.cwd() == before
    assert caught.value.place == fmu
    assert f" binaries/{LIBRARY_FOLDER[version]}/mixed.so" in caught.value.problem
    assert str(tmp_path) not in caught.value.problem


@pytest.mark.parametrize("version", [2, 3])
def test_another_token_is_refused_by_the_fmu(build_mixed, make_twin, binding, version):
    with pytest.raises(TwinError, match="cannot be instantiated"):
        make_twin(fmu=build_mixed(version, ("{mixed}", "{other}")), binding=binding)


def test_an_invalid_description_is_refused_with_its_problems(build_mixed, make_twin, binding):
    twice = ('name="count"', 'name="force"')
    with pytest.raises(ConfigError, match="not valid"):
        make_twin(fmu=build_mixed(2, twice), binding=binding)


def test_model_exchange_and_fmi_1_are_refused(build_mixed, make_twin, binding):
    exchange = ('<CoSimulation modelIdentifier="mixed"/>', '<ModelExchange modelIdentifier="mixed"/>')
    with pytest.raises(ConfigError, match="is not for co-simulation"):
        make_twin(fmu=build_mixed(2, exchange), binding=binding)


def test_a_zip_without_description_is_no_fmu(make_twin, tmp_path, binding):
    fmu = tmp_path / "empty.fmu"
    with zipfile.ZipFile(fmu, "w") as archive:
        archive.writestr("readme.txt", textwrap.dedent("nothing"))
    with pytest.raises(ConfigError, match="cannot be read") as caught:
        make_twin(fmu=str(fmu), binding=binding)
    assert caught.value.place == str(fmu)
    assert str(tmp_path) not in caught.value.problem


@pytest.mark.parametrize("version", [2, 3])
def test_a_fatal_status_gives_a_new_instance_at_reset(build_mixed, make_twin, binding, version):
    """After a fatal status no function may be called on the instance, not even reset (the plant aborts if so)."""
    twin = make_twin(fmu=build_mixed(version), binding=binding)
    twin.reset({"offset": -100}, 0)  # the plant takes this as an order to fail fatally
    with pytest.raises(TwinError, match="gave fatal") as caught:
        twin.advance(10 * MS)
    assert "offset is -100" in caught.value.log
    twin.reset({}, 0)
    assert len(twin.advance(20 * MS)) == 5
