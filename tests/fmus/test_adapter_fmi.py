"""The adapter, called through FMPy: both FMI versions, against a closed form and against the standards."""

from __future__ import annotations

import math
import re
import subprocess
from pathlib import Path

import fmpy
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu
from hypothesis import given, settings
from hypothesis import strategies as st

from foreshock_fmus import build_fmu

pytestmark = pytest.mark.filterwarnings("error")

MASS, STIFFNESS, DAMPING, X0 = 2.0, 50.0, 1.5, 0.1  # oscillator.toml


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("fmus")


@pytest.fixture(scope="session")
def oscillator():
    return Path(__file__).parents[1] / "twins" / "plants" / "oscillator"


def closed_form(t, x0, v0, force):
    """Position and velocity of the under-damped oscillator under a constant force."""
    decay = DAMPING / (2.0 * MASS)
    omega = math.sqrt(STIFFNESS / MASS - decay**2)
    a = x0 - force / STIFFNESS
    b = (v0 + decay * a) / omega
    e, c, s = math.exp(-decay * t), math.cos(omega * t), math.sin(omega * t)
    x = force / STIFFNESS + e * (a * c + b * s)
    return x, -decay * e * (a * c + b * s) + e * omega * (b * c - a * s)


class Fmu:
    """What both versions of FMPy's interface have in common."""

    def __init__(self, path: Path, folder: Path, start=True):
        self.version = 2 if "-fmi2-" in path.name else 3
        fmpy.extract(path, folder)
        self.description = fmpy.read_model_description(folder)
        self.refs = {v.name: v.valueReference for v in self.description.modelVariables}
        self.messages: list[str] = []
        self.slave = (FMU2Slave if self.version == 2 else FMU3Slave)(
            guid=self.description.guid, unzipDirectory=str(folder), modelIdentifier="oscillator"
        )
        if self.version == 2:
            self.slave.instantiate()
        else:
            self.slave.instantiate(logMessage=lambda *a: self.messages.append(a[3].decode()))
        if start:
            self.enter()
            self.slave.exitInitializationMode()

    def enter(self):
        if self.version == 2:
            self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()

    def get(self, *names):
        refs = [self.refs[n] for n in names]
        return self.slave.getReal(refs) if self.version == 2 else self.slave.getFloat64(refs)

    def set(self, **values):
        refs = [self.refs[n] for n in values]
        setter = self.slave.setReal if self.version == 2 else self.slave.setFloat64
        setter(refs, list(values.values()))

    def run(self, first, last, h=1e-3):
        for k in range(first, last):
            self.slave.doStep(k * h, h)
        return self.get("position", "velocity")


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def version(request):
    return request.param


@pytest.fixture
def fmu_path(oscillator, version, cache):
    return build_fmu(oscillator, version, cache)


@pytest.fixture
def fmu(fmu_path, tmp_path):
    made = Fmu(fmu_path, tmp_path)
    yield made
    made.slave.freeInstance()


def test_fmpy_finds_nothing_to_complain_about(fmu_path):
    assert validate_fmu(str(fmu_path)) == []


def test_every_function_of_the_standard_is_exported(fmu_path, version, tmp_path):
    header = Path(fmpy.__file__).parent / "c-code" / f"fmi{version}Functions.h"
    declared = set(re.findall(rf"fmi{version}\w+TYPE\s+(fmi{version}\w+);", header.read_text()))
    fmpy.extract(fmu_path, tmp_path)
    library = next(tmp_path.glob("binaries/*/oscillator.so"))
    symbols = subprocess.run(["nm", "-D", "--defined-only", str(library)], capture_output=True, text=True, check=True)
    exported = {line.split()[-1] for line in symbols.stdout.splitlines()}
    assert exported == declared  # and nothing else: the plant's own names stay inside
    assert len(declared) == {2: 44, 3: 75}[version]


# RK4 at h = 1 ms: local error (omega h)^5 / 120 of the amplitude, 1000 steps: 3e-12 m.
TOLERANCE = 1e-10


def test_agrees_with_the_closed_form_also_when_the_input_changes(fmu):
    x, v = fmu.run(0, 500)
    expected = closed_form(0.5, X0, 0.0, 0.0)
    assert (x, v) == pytest.approx(expected, abs=TOLERANCE)
    fmu.set(force=20.0)
    assert fmu.run(500, 1000) == pytest.approx(closed_form(0.5, *expected, 20.0), abs=TOLERANCE)


def test_reset_equals_new(fmu, fmu_path, tmp_path_factory):
    fmu.set(force=-7.0)
    fmu.run(0, 50)
    fmu.slave.reset()
    fmu.enter()
    fmu.slave.exitInitializationMode()
    new = Fmu(fmu_path, tmp_path_factory.mktemp("new"))
    names = list(new.refs)
    assert fmu.get(*names) == new.get(*names)
    assert fmu.run(0, 50) == new.run(0, 50)
    new.slave.freeInstance()


def test_two_instances_of_one_library_do_not_share_state(fmu, fmu_path, tmp_path_factory):
    other = Fmu(fmu_path, tmp_path_factory.mktemp("other"))
    other.set(force=100.0)
    other.run(0, 100)
    assert fmu.run(0, 100) == pytest.approx(closed_form(0.1, X0, 0.0, 0.0), abs=TOLERANCE)
    other.slave.freeInstance()


def test_state_is_taken_back_also_from_bytes(fmu):
    fmu.run(0, 100)
    state = fmu.slave.getFMUState()
    expected = fmu.run(100, 200)
    fmu.slave.setFMUState(state)
    assert fmu.get("time") == [pytest.approx(0.1, abs=1e-15)]
    assert fmu.run(100, 200) == expected
    copy = fmu.slave.deserializeFMUState(fmu.slave.serializeFMUState(state))
    fmu.slave.setFMUState(copy)
    assert fmu.run(100, 200) == expected
    fmu.slave.freeFMUState(state)
    fmu.slave.freeFMUState(copy)


def test_foreign_bytes_are_no_state(fmu):
    state = fmu.slave.getFMUState()
    data = bytearray(fmu.slave.serializeFMUState(state))
    fmu.slave.freeFMUState(state)
    for wrong in (bytes(data[:-1]), b"x" + bytes(data[1:])):
        with pytest.raises(FMICallException, match="error"):
            fmu.slave.deserializeFMUState(wrong)


@pytest.mark.parametrize(
    ("t", "h"),
    [(0.0, 0.0), (0.0, -1e-3), (0.0, math.nan), (0.0, math.inf), (0.5, 1e-3), (-1e-3, 1e-3), (math.nan, 1e-3)],
)
def test_a_step_must_go_forward_from_where_the_plant_is(fmu, t, h):
    with pytest.raises(FMICallException, match="error"):
        fmu.slave.doStep(t, h)
    assert fmu.run(0, 10) == pytest.approx(closed_form(0.01, X0, 0.0, 0.0), abs=TOLERANCE)


def test_outputs_parameters_and_ranges_are_guarded(fmu):
    for wrong in ({"position": 1.0}, {"mass": 3.0}, {"force": math.nan}, {"force": 1001.0}, {"time": 1.0}):
        before = fmu.get("position", "mass", "force")
        with pytest.raises(FMICallException, match="error"):
            fmu.set(**wrong)
        assert fmu.get("position", "mass", "force") == before
    fmu.refs["nowhere"] = 999
    with pytest.raises(FMICallException, match="error"):
        fmu.get("nowhere")


def test_one_wrong_value_sets_none(fmu):
    with pytest.raises(FMICallException):
        fmu.set(force=5.0, position=1.0)
    assert fmu.get("force") == [0.0]


def test_calls_out_of_order_are_errors(fmu_path, tmp_path):
    fmu = Fmu(fmu_path, tmp_path, start=False)
    for call in (lambda: fmu.slave.doStep(0.0, 1e-3), fmu.slave.exitInitializationMode, fmu.slave.terminate):
        with pytest.raises(FMICallException, match="error"):
            call()
    fmu.enter()
    with pytest.raises(FMICallException, match="error"):
        fmu.slave.doStep(0.0, 1e-3)
    fmu.slave.exitInitializationMode()
    fmu.slave.doStep(0.0, 1e-3)
    fmu.slave.terminate()
    with pytest.raises(FMICallException, match="error"):
        fmu.slave.doStep(1e-3, 1e-3)
    fmu.slave.freeInstance()


def test_outputs_follow_parameters_in_initialization_mode(fmu_path, tmp_path):
    fmu = Fmu(fmu_path, tmp_path, start=False)
    fmu.set(x0=0.3)
    fmu.enter()
    assert fmu.get("position") == [0.3]
    fmu.set(x0=-0.2, stiffness=100.0)
    assert fmu.get("position", "spring[1]", "joint.angle[2]") == [-0.2, 20.0, 0.2]
    fmu.slave.freeInstance()


def test_errors_are_said_through_the_logger(oscillator, cache, tmp_path):
    fmu = Fmu(build_fmu(oscillator, 3, cache), tmp_path)
    with pytest.raises(FMICallException):
        fmu.set(force=1e9)
    assert fmu.messages == ["force = 1e+09 is outside [-1000, 1000]"]
    fmu.slave.freeInstance()


def test_both_versions_give_the_same_bits(oscillator, cache, tmp_path):
    results = []
    for v in (2, 3):
        path = build_fmu(oscillator, v, cache)
        names = [u.name for u in fmpy.read_model_description(str(path)).modelVariables if u.causality == "output"]
        result = fmpy.simulate_fmu(str(path), stop_time=0.5, step_size=1e-3, output_interval=1e-3, output=names)
        results.append(result.tolist())
    assert results[0] == results[1]


@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_any_cut_of_a_run_gives_back_the_same_end(data, oscillator, cache, tmp_path_factory):
    """Get state, run, set state, run again: bit by bit the same, wherever the cut and whatever the force."""
    cut = data.draw(st.integers(0, 40))
    force = data.draw(st.floats(-1000.0, 1000.0))
    fmu = Fmu(build_fmu(oscillator, data.draw(st.sampled_from([2, 3])), cache), tmp_path_factory.mktemp("cut"))
    fmu.set(force=force)
    fmu.run(0, cut)
    state = fmu.slave.getFMUState()
    end = fmu.run(cut, 50)
    fmu.slave.setFMUState(state)
    assert fmu.run(cut, 50) == end
    fmu.slave.freeFMUState(state)
    fmu.slave.freeInstance()
