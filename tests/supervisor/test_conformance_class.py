"""The conformance class accepts the detector that keeps every rule, and finds each one that breaks one."""

from __future__ import annotations

import inspect
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from types import SimpleNamespace

import numpy as np
import pytest
from tests.rogues.plugins import rogue_detectors as rogues

from foreshock.messages import Scalar
from foreshock.records import Sample
from foreshock.testing import DetectorConformance


def knee() -> list[Sample]:
    """Two seconds at 200 Hz: 40 N m with 2 N m of noise, and 130 N m in between."""
    rng = np.random.default_rng(7)
    out = []
    for k in range(400):
        stamp_ns = 5_000_000 * (k + 1)
        torque = (130.0 if 200 <= k < 300 else 40.0) + 2.0 * float(rng.standard_normal())
        out.append(Sample(stamp_ns, "talos/knee/torque", Scalar(torque), k))
        out.append(Sample(stamp_ns, "talos/knee/speed", Scalar(0.1), k))
    return out


class TestUpright(DetectorConformance):
    spec = rogues.spec_of(rogues.Upright)

    def recording(self) -> Sequence[Sample]:
        return knee()


def cases(suite: DetectorConformance) -> Iterator[tuple[str, Callable[[], None]]]:
    """Every test of the class, as pytest would collect it."""
    for name in [n for n in dir(type(suite)) if n.startswith("test_")]:
        test = getattr(suite, name)
        wants = inspect.signature(test).parameters
        values: dict[tuple[str, str], list[tuple[str, str]]] = {}
        suite.pytest_generate_tests(SimpleNamespace(fixturenames=list(wants), parametrize=values.__setitem__))
        if not wants:
            yield name, test
        for lost_input, loss in values.get(("lost_input", "loss"), []):
            yield name, lambda i=lost_input, w=loss, t=test: t(i, w)  # type: ignore[misc]


def failure(build: type[rogues.Upright], wanted: str) -> str:
    """What the wanted test says of a detector; empty if it passes."""

    class Suite(DetectorConformance):
        spec = rogues.spec_of(build)

        def recording(self) -> Sequence[Sample]:
            return knee()

    for name, test in cases(Suite()):
        if name == wanted:
            try:
                test()
            except AssertionError as e:
                return str(e)
    return ""


@pytest.mark.parametrize(
    ("build", "test", "says"),
    [
        (rogues.Raises, "test_every_update_is_valid", "ZeroDivisionError: at the fiftieth update"),
        (rogues.SaysNan, "test_every_update_is_valid", "statistic nan"),
        (rogues.Undeclared, "test_every_update_is_valid", "'actuator-drift' is not among the declared"),
        (rogues.Prophet, "test_every_update_is_valid", "lies after the tick"),
        (rogues.NoEvidence, "test_every_update_is_valid", "without any evidence"),
        (rogues.FalseEvidence, "test_every_update_is_valid", "a sample that does not exist"),
        (rogues.SpeaksOnlyWhenPresent, "test_every_update_speaks_of_every_kind", "torque-saturation"),
        (rogues.AlwaysPresent, "test_every_kind_is_present_and_absent", "never absent"),
        (rogues.ReadsClock, "test_reads_no_clock_no_global_randomness_no_files", "time.monotonic_ns"),
        (rogues.ReadsClockByName, "test_reads_no_clock_no_global_randomness_no_files", "time.monotonic"),
        (rogues.HidesClock, "test_reads_no_clock_no_global_randomness_no_files", "time.time"),
        (rogues.DrawsGlobally, "test_reads_no_clock_no_global_randomness_no_files", "random.random"),
        (rogues.DrawsGlobally, "test_same_input_same_output", "against"),
        (rogues.DrawsUnseeded, "test_reads_no_clock_no_global_randomness_no_files", "default_rng without a seed"),
        (rogues.ReadsFile, "test_reads_no_clock_no_global_randomness_no_files", "open"),
        (rogues.Forgetless, "test_reset_equals_new", "count"),
        (rogues.EmptiesInputs, "test_changes_neither_inputs_nor_past_answers", "its inputs"),
        (rogues.RewritesHistory, "test_changes_neither_inputs_nor_past_answers", "its previous answer"),
        (rogues.ClearsWithoutOptional, "test_lost_input_is_never_absence", "without speed"),
        (rogues.NeedsOptional, "test_lost_input_is_never_absence", "KeyError"),
        (rogues.ConfusedByDuplicates, "test_survives_duplicates_and_disorder", "a stamp came twice"),
        (rogues.Slow, "test_cpu_time_is_within_the_deadline", "0.001 declared"),
        (rogues.OtherInChild, "test_says_the_same_in_a_child_process", "against"),
    ],
)
def test_each_broken_rule_is_found(build: type[rogues.Upright], test: str, says: str) -> None:
    assert says in failure(build, test)
    assert failure(rogues.Upright, test) == ""


def test_foreshock_testing_needs_no_pytest() -> None:
    code = "import sys, foreshock.testing; sys.exit('pytest' in sys.modules or '_pytest' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_class_without_a_recording_says_so() -> None:
    class Bare(DetectorConformance):
        spec = rogues.spec_of(rogues.Upright)

    with pytest.raises(NotImplementedError, match=r"Bare must give a recording\(\)"):
        Bare().test_recording_is_usable()
