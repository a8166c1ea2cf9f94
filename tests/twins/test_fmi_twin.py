"""The FMU twin on a plant with a closed-form solution."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foreshock.errors import BadInputError, ConfigError, TwinError
from foreshock.messages import Humans, JointState, MotionPlan, WrenchStamped
from foreshock.records import Intervention
from foreshock.twin import Channel
from foreshock_twins.fmi import FmiTwinConfig, build_twin, foreshock_twins

MS = 1_000_000
MASS, STIFFNESS, DAMPING, X0 = 2.0, 50.0, 1.5, 0.1  # oscillator.toml
TOLERANCE = 1e-10  # RK4 at 1 ms over 1 s: 3e-12 m


def closed_form(t, x0=X0, v0=0.0, force=0.0, damping=DAMPING):
    decay = damping / (2.0 * MASS)
    omega = math.sqrt(STIFFNESS / MASS - decay**2)
    a = x0 - force / STIFFNESS
    b = (v0 + decay * a) / omega
    e, c, s = math.exp(-decay * t), math.cos(omega * t), math.sin(omega * t)
    return force / STIFFNESS + e * (a * c + b * s), -decay * e * (a * c + b * s) + e * omega * (b * c - a * s)


def ask(twin, action, strength):
    twin.intervene(Intervention(0, action, strength))


def state(twin):
    probes = twin.probes()
    return probes["x"], probes["v"]


def test_it_declares_what_the_binding_says(oscillator):
    assert oscillator.channels == (
        Channel("joints/state", "JointState", 1 * MS),
        Channel("spring/wrench", "WrenchStamped", 5 * MS),
        Channel("mass/plan", "MotionPlan", 2 * MS),
        Channel("humans/poses", "Humans", 33 * MS),
    )
    assert (oscillator.period_ns, oscillator.stepped, oscillator.actions) == (MS, True, {"push", "pull"})


def test_samples_carry_the_closed_form(oscillator):
    oscillator.reset({}, 0)
    samples = [s for k in range(1, 101) for s in oscillator.advance(k * MS)]
    by_channel = {}
    for s in samples:
        by_channel.setdefault(s.channel, []).append(s)
    joints = by_channel["talos/joints/state"]
    assert [(s.seq, s.stamp_ns, s.received_ns) for s in joints] == [(k, (k + 1) * MS, (k + 1) * MS) for k in range(100)]
    for s in joints:
        x, _ = closed_form(s.stamp_ns * 1e-9)
        assert isinstance(s.value, JointState)
        assert s.value.name == ("drum", "counter")
        assert s.value.position == pytest.approx((x, -x), abs=TOLERANCE)
        assert s.value.velocity == ()
    wrenches = by_channel["talos/spring/wrench"]
    assert [(s.seq, s.stamp_ns, s.received_ns) for s in wrenches] == [
        (k, (5 * k + 3) * MS, (5 * k + 5) * MS)
        for k in range(20)  # the plant stamps 2 ms behind
    ]
    for s in wrenches:
        assert isinstance(s.value, WrenchStamped)
        assert s.value.force == pytest.approx((-STIFFNESS * closed_form(s.received_ns * 1e-9)[0], 0.0, 0.0), abs=1e-8)
        assert (s.value.torque, s.value.frame_id) == ((0.0, 0.0, 0.0), "mass")
    plans = by_channel["talos/mass/plan"]
    assert len(plans) == 50
    for s in plans:
        x, v = closed_form(s.stamp_ns * 1e-9)
        assert isinstance(s.value, MotionPlan)
        assert s.value.com == pytest.approx((x, 0.0, 0.5), abs=TOLERANCE)
        assert s.value.speed == pytest.approx(v, abs=1e-9)
        assert s.value.support == (("left",) if v < 0.0 else ("right",))
    humans = by_channel["talos/humans/poses"]
    assert [s.stamp_ns for s in humans] == [33 * MS, 66 * MS, 99 * MS]
    for s in humans:
        assert isinstance(s.value, Humans)
        (human,) = s.value.humans
        assert (human.id, len(human.capsules)) == ("bystander", 14)
        assert human.velocity == pytest.approx((closed_form(s.stamp_ns * 1e-9)[1], 0.0, 0.0), abs=1e-9)


def test_one_long_advance_equals_many_short_ones(oscillator):
    oscillator.reset({}, 0)
    short = [s for k in range(1, 67) for s in oscillator.advance(k * MS)]
    oscillator.reset({}, 0)
    long = list(oscillator.advance(66 * MS))
    assert long == sorted(short, key=lambda s: s.stamp_ns)
    assert oscillator.advance(66 * MS) == []
    assert oscillator.advance(67 * MS - 1) == []  # only whole steps


def test_reset_equals_new_and_parameters_come_back(oscillator):
    oscillator.reset({"x0": -0.3, "damping": 4.0}, 1)
    ask(oscillator, "push", 1.0)
    oscillator.advance(200 * MS)
    oscillator.reset({}, 0)
    assert state(oscillator) == (X0, 0.0)
    oscillator.advance(300 * MS)
    assert state(oscillator) == pytest.approx(closed_form(0.3), abs=TOLERANCE)


def test_parameters_are_the_run_s(oscillator):
    oscillator.reset({"x0": 0.25, "damping": 4.0}, 0)
    oscillator.advance(400 * MS)
    assert state(oscillator) == pytest.approx(closed_form(0.4, x0=0.25, damping=4.0), abs=TOLERANCE)


def test_strength_scales_from_the_start_value(oscillator):
    oscillator.reset({}, 0)
    ask(oscillator, "push", 0.25)
    oscillator.advance(300 * MS)
    middle = closed_form(0.3, force=25.0)
    assert state(oscillator) == pytest.approx(middle, abs=TOLERANCE)
    ask(oscillator, "push", 0.0)
    oscillator.advance(500 * MS)
    assert state(oscillator) == pytest.approx(closed_form(0.2, *middle), abs=TOLERANCE)


def test_the_action_that_goes_farthest_wins_each_input(oscillator):
    oscillator.reset({}, 0)
    ask(oscillator, "push", 0.2)  # force +20
    ask(oscillator, "pull", 1.0)  # force -40, brake 3
    oscillator.advance(100 * MS)
    expected = closed_form(0.1, force=-40.0, damping=3.0 * DAMPING)
    assert state(oscillator) == pytest.approx(expected, abs=TOLERANCE)
    ask(oscillator, "pull", 0.0)
    oscillator.advance(200 * MS)
    assert state(oscillator) == pytest.approx(closed_form(0.1, *expected, 20.0), abs=TOLERANCE)


@settings(max_examples=30, deadline=None)
@given(push=st.floats(0.0, 1.0), pull=st.floats(0.0, 1.0), order=st.booleans())
def test_the_order_of_interventions_does_not_matter(shared_twin, push, pull, order):
    shared_twin.reset({}, 0)
    for action, strength in sorted({"push": push, "pull": pull}.items(), reverse=order):
        ask(shared_twin, action, strength)
    shared_twin.advance(20 * MS)
    force = 100.0 * push if 100.0 * push > 40.0 * pull else -40.0 * pull
    expected = closed_form(0.02, force=force, damping=DAMPING * (1.0 + 2.0 * pull))
    if not math.isclose(100.0 * push, 40.0 * pull, rel_tol=1e-9):
        assert state(shared_twin) == pytest.approx(expected, abs=TOLERANCE)


@pytest.fixture(scope="module")
def shared_twin(tmp_path_factory):
    from pathlib import Path

    plant = Path(__file__).parent / "plants" / "oscillator"
    twin = build_twin(FmiTwinConfig(plant=str(plant)), "talos", tmp_path_factory.mktemp("shared"))
    yield twin
    twin.close()


def test_unknown_actions_are_ignored_and_wrong_strengths_are_not(oscillator):
    oscillator.reset({}, 0)
    ask(oscillator, "sing", 1.0)
    for strength in (math.nan, -0.1, 1.1):
        with pytest.raises(BadInputError, match=r"expected 0\.\.1"):
            ask(oscillator, "push", strength)
    oscillator.advance(10 * MS)
    assert state(oscillator) == pytest.approx(closed_form(0.01), abs=TOLERANCE)


def test_an_event_happens_once_and_keeps_its_worst_value(oscillator):
    oscillator.reset({}, 0)
    oscillator.advance(250 * MS)
    assert oscillator.events() == []  # a quarter period is 0.316 s
    seen = None
    for k in range(251, 1800):
        oscillator.advance(k * MS)
        x, v = closed_form(k * 1e-3)
        if seen is None and x < 0.0 and v < -0.1:
            seen = k
    (event,) = oscillator.events()
    assert (event.stamp_ns, event.id, event.mode, event.limit, event.unit) == (seen * MS, "turn", "A1", 0.5, "1")
    assert event.value == 1.0
    oscillator.reset({}, 0)
    assert oscillator.events() == []


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"mas": 1.0}, "no parameter 'mas'; did you mean 'mass'"),
        ({"force": 1.0}, "no parameter 'force'"),  # an input
        ({"mass": math.nan}, "out of range"),
        ({"mass": 0.0}, "out of range"),
        ({"seed": 3.0}, "set by the seed"),
    ],
)
def test_wrong_parameters_are_refused(oscillator, parameters, said):
    with pytest.raises(ConfigError, match=said):
        oscillator.reset(parameters, 0)


def test_seeds_of_any_size_are_accepted(oscillator):
    oscillator.reset({}, 2**64 - 1)


def test_before_reset_and_after_close_it_does_not_run(oscillator):
    assert oscillator.probes() == {}
    with pytest.raises(TwinError, match="has not been reset"):
        oscillator.advance(MS)
    oscillator.reset({}, 0)
    oscillator.close()
    oscillator.close()
    with pytest.raises(TwinError, match="closed"):
        oscillator.advance(MS)


def test_both_fmi_versions_give_the_same_samples(make_twin):
    plant = Path(__file__).parent / "plants" / "oscillator"
    runs = []
    for version in (2, 3):
        twin = make_twin(plant=str(plant), fmi_version=version)
        twin.reset({"x0": 0.2}, 5)
        ask(twin, "push", 0.3)
        runs.append(twin.advance(400 * MS))
    assert runs[0] == runs[1]


def test_everything_temporary_lies_in_scratch_and_cwd_is_kept(make_twin, tmp_path, monkeypatch):
    import tempfile

    system_tmp = tmp_path / "system-tmp"
    system_tmp.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(system_tmp))
    before = Path.cwd()
    plant = Path(__file__).parent / "plants" / "oscillator"
    make_twin(plant=str(plant)).reset({}, 0)
    assert Path.cwd() == before
    assert list(system_tmp.iterdir()) == []


def test_the_hook_offers_it():
    (spec,) = foreshock_twins()
    assert (spec.id, spec.config, spec.build) == ("fmu", FmiTwinConfig, build_twin)
