"""Faults of sensors, messages, actuators and detectors: what each does, what it leaves alone, how it fails closed."""

from __future__ import annotations

import math
from types import ModuleType

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foreshock.detector import Input, Inputs
from foreshock.errors import ConfigError
from foreshock.hookspecs import hookimpl
from foreshock.messages import Humans, Imu, JointState, Odometry, Scalar
from foreshock.recording import Head, McapJournal
from foreshock.records import Indication, Intervention, Sample
from foreshock.registry import Registry
from foreshock.session.faults import Fault, parse_faults
from foreshock.session.faulty import FaultyTwin
from foreshock.session.fields import changed, path_in
from foreshock.session.replay import replay
from foreshock.session.run import Arm, Run
from foreshock.session.scenario import Scenario, load_scenario
from foreshock.session.simulate import simulate
from foreshock.supervisor import Supervisor
from foreshock.testing import PendulumTwin, threshold_spec

MS = 1_000_000
KINDS = {"lean": "com-lateral-deviation", "rate": "torso-angular-spike", "kick": "foot-micro-slip"}
CONFIG = {
    "supervisor": {"period_s": 0.01},
    "detectors": [
        {"use": "lean", "config": {"threshold": 0.05}},
        {"use": "rate", "config": {"threshold": 0.15}},
        {"use": "kick", "config": {"threshold": 0.1}},
    ],
    "gates": {"latch": "none"},
    "policies": [{"use": "paper-gate"}],
}
LEAN = Scenario("a1-lean", "pushed", "A1", "accident", 2.0, {"kind": "pendulum"}, CONFIG, {"push": 0.4, "noise": 0.002})


def faults(*tables: dict[str, object]) -> tuple[Fault, ...]:
    return parse_faults(list(tables), "test")


def streamed(*tables: dict[str, object], until_s: float = 1.0, seed: int = 3) -> list[Sample]:
    """What a pushed pendulum with these faults streams, in steps of 10 ms."""
    twin = FaultyTwin(PendulumTwin(), faults(*tables), "test")
    twin.reset({"push": 0.4, "noise": 0.01}, seed)
    return [s for k in range(1, round(until_s * 100) + 1) for s in twin.advance(k * 10 * MS)]


def on(samples: list[Sample], channel: str) -> list[Sample]:
    return [s for s in samples if s.channel == f"talos/body/{channel}"]


def module(specs) -> ModuleType:
    made = ModuleType("detectors")
    made.foreshock_detectors = hookimpl(lambda: specs)
    return made


class AbsentFrom:
    """A detector that says from a time on what an honest one says when there is nothing."""

    def __init__(self, inner, from_ns: int) -> None:
        self._inner, self._from_ns = inner, from_ns

    def reset(self, seed: int) -> None:
        self._inner.reset(seed)

    def update(self, now_ns: int, inputs: Inputs) -> list[Indication]:
        said = self._inner.update(now_ns, inputs)
        if now_ns <= self._from_ns:
            return said
        return [msgspec.structs.replace(i, present=False, severity=0.0) for i in said]


def registry(absent: str = "", from_ns: int = 0, still_s: float = 0.1) -> Registry:
    modules = {}
    for name, kind in KINDS.items():
        inputs = (Input("value", f"body/{name}", Scalar, max_standstill_s=still_s),)
        spec = threshold_spec(name, kind, f"body/{name}", inputs=inputs)
        if name == absent:
            honest = spec.build
            spec = msgspec.structs.replace(spec, build=lambda c, build=honest: AbsentFrom(build(c), from_ns))
        modules[name] = module([spec])
    return Registry(modules)


def run(arm: Arm = "on", *tables: dict[str, object], seed: int = 0, using: Registry | None = None, **more) -> Run:
    scenario = msgspec.structs.replace(LEAN, faults=faults(*tables))
    supervisor = Supervisor(scenario.supervisor(), registry=using or registry()) if arm != "off" else None
    return simulate(scenario, PendulumTwin(), supervisor, arm, seed, **more)


BARE = streamed()
LEANS = on(BARE, "lean")


def test_without_faults_a_faulty_twin_is_the_twin() -> None:
    twin = PendulumTwin()
    twin.reset({"push": 0.4, "noise": 0.01}, 3)
    assert [s for k in range(1, 101) for s in twin.advance(k * 10 * MS)] == BARE


def test_a_dropout_is_silence_whose_numbers_show_no_gap_and_a_loss_shows_one() -> None:
    spell = {"channel": "body/lean", "from_s": 0.2, "until_s": 0.4}
    silent, lossy = (on(streamed({"kind": k, **spell}), "lean") for k in ("dropout", "loss"))
    kept = [s for s in LEANS if not 200 * MS <= s.stamp_ns < 400 * MS]
    assert [(s.stamp_ns, s.value) for s in silent] == [(s.stamp_ns, s.value) for s in kept]
    assert [s.seq for s in silent] == list(range(len(kept)))
    assert lossy == kept


def test_frozen_values_have_fresh_stamps() -> None:
    frozen = on(streamed({"kind": "freeze", "channel": "body/lean", "from_s": 0.5}), "lean")
    assert [(s.stamp_ns, s.seq) for s in frozen] == [(s.stamp_ns, s.seq) for s in LEANS]
    last = next(s for s in reversed(LEANS) if s.stamp_ns < 500 * MS).value
    assert [s.value for s in frozen] == [s.value if s.stamp_ns < 500 * MS else last for s in LEANS]


def test_a_delay_moves_arrivals_and_nothing_else() -> None:
    table = {"kind": "delay", "channel": "body/lean", "magnitude": 0.033, "from_s": 0.2, "until_s": 0.4}
    given = streamed(table)
    late = on(given, "lean")
    assert sorted((s.stamp_ns, s.seq, s.value.data) for s in late) == [(s.stamp_ns, s.seq, s.value.data) for s in LEANS]
    assert {s.received_ns - s.stamp_ns for s in late if 200 * MS <= s.stamp_ns < 400 * MS} == {33 * MS}
    assert [s.received_ns for s in given] == sorted(s.received_ns for s in given)
    assert [s.stamp_ns for s in late] != sorted(s.stamp_ns for s in late), (
        "the first in time overtake the last late ones"
    )


def test_bias_and_noise_change_numbers_in_their_time() -> None:
    spell = {"channel": "body/lean", "fields": ["data"], "unit": "rad", "from_s": 0.3, "until_s": 0.9}
    biased = on(streamed({"kind": "bias", "magnitude": 0.1, **spell}), "lean")
    for s, bare in zip(biased, LEANS, strict=True):
        assert s.value.data == bare.value.data + (0.1 if 300 * MS <= s.stamp_ns < 900 * MS else 0.0)
    noisy = on(streamed({"kind": "noise", "magnitude": 0.1, **spell}), "lean")
    added = [s.value.data - bare.value.data for s, bare in zip(noisy, LEANS, strict=True)]
    inside = [a for a, s in zip(added, LEANS, strict=True) if 300 * MS <= s.stamp_ns < 900 * MS]
    assert sum(a != 0.0 for a in added) == len(inside) == 120
    # standard deviation of 120 draws: within four standard errors, 0.1 / sqrt(2 * 120) each
    assert math.sqrt(sum(a * a for a in inside) / 120) == pytest.approx(0.1, abs=4 * 0.1 / math.sqrt(240))


def test_not_a_number_spoils_every_number() -> None:
    assert all(math.isnan(s.value.data) for s in on(streamed({"kind": "nan", "channel": "body/lean"}), "lean"))


def test_each_fault_has_a_stream_of_its_own() -> None:
    noise = {"kind": "noise", "channel": "body/lean", "fields": ["data"], "magnitude": 0.1, "unit": "rad"}
    loss = {"kind": "loss", "channel": "body/rate", "probability": 0.3}
    alone, both = streamed(noise), streamed(loss, noise)
    assert on(alone, "lean") == on(both, "lean") == on(streamed(noise), "lean")
    assert on(alone, "lean") != on(streamed(noise, seed=4), "lean")
    assert on(both, "kick") == on(BARE, "kick")
    later = {**noise, "from_s": 0.5}
    assert on(streamed(later), "lean")[150:] == on(alone, "lean")[150:], "two spells share their noise"
    assert 0.2 < 1.0 - len(on(both, "rate")) / len(on(BARE, "rate")) < 0.4
    more = {s.seq for s in on(streamed({**loss, "probability": 0.6}), "rate")}
    assert more < {s.seq for s in on(both, "rate")}, "what is lost at 0.3 is lost at 0.6"


def test_a_probable_fault_happens_in_all_of_a_run_or_not_at_all() -> None:
    table = {"kind": "dropout", "channel": "body/*", "probability": 0.5}
    counts = [len(streamed(table, until_s=0.05, seed=seed)) for seed in range(40)]
    assert set(counts) == {0, 30}
    assert 10 < counts.count(0) < 30


def test_the_plant_never_knows_of_sensor_faults() -> None:
    spoilt = [
        {"kind": "noise", "channel": "*", "fields": ["data"], "magnitude": 1.0, "unit": "rad"},
        {"kind": "delay", "channel": "body/rate", "magnitude": 0.1},
        {"kind": "loss", "channel": "*", "probability": 0.5},
    ]
    bare, faulty = run("shadow"), run("shadow", *spoilt)
    assert faulty.events == bare.events != ()
    assert faulty.series["true:lean_rad"] == bare.series["true:lean_rad"]
    assert faulty.digest != bare.digest
    assert run("on", *spoilt, seed=5).digest == run("on", *spoilt, seed=5).digest


def test_actuators_that_ignore_or_obey_late() -> None:
    assert run("off").accident
    assert not run("on").accident
    ignoring = run("on", {"kind": "ignored", "actions": ["balance-*"]})
    assert ignoring.accident
    assert ignoring.ignored == run("on").ignored, "nobody is told"
    assert run("on", {"kind": "ignored", "actions": ["step-suppression"]}).accident is False
    assert not run("on", {"kind": "late", "magnitude": 0.02}).accident
    assert run("on", {"kind": "late", "magnitude": 1.0}).accident


def test_commands_keep_their_order_and_take_effect_in_the_step_in_which_they_are_due() -> None:
    told: list[tuple[int, float]] = []

    class Recorder(PendulumTwin):
        def intervene(self, intervention: Intervention) -> None:
            told.append((self._t, intervention.strength))

    twin = FaultyTwin(Recorder(), faults({"kind": "late", "magnitude": 0.012, "until_s": 0.011}), "test")
    twin.reset({}, 0)
    twin.advance(10 * MS)
    twin.intervene(Intervention(10 * MS, "balance-lock", 1.0))
    twin.advance(20 * MS)
    twin.intervene(Intervention(20 * MS, "balance-lock", 0.5))  # not late any more, but it may not overtake
    twin.intervene(Intervention(20 * MS, "step-suppression", 0.7))
    twin.advance(30 * MS)
    assert told == [(20 * MS, 0.7), (25 * MS, 1.0), (25 * MS, 0.5)]


def test_a_detector_that_raises_is_failed_and_a_replay_raises_too(tmp_path) -> None:
    crash = {"kind": "crash", "detector": "kick", "from_s": 0.7}
    path = tmp_path / "run.mcap"
    journal = McapJournal(path, Head(CONFIG, "", 0, 0))
    crashed = run("on", crash, journals=[journal])
    journal.close()
    states = [h for h in crashed.health if h.source == "kick" and h.state == "failed"]
    assert states[0].stamp_ns == 700 * MS
    assert "fault injected" in states[0].reason
    assert "gave up" in states[-1].reason
    again = replay(path, registry())
    assert again.agrees
    assert again.replayed == crashed.digest


@settings(max_examples=25)
@given(
    st.sampled_from(["dropout", "loss", "nan", "freeze", "delay", "crash"]),
    st.sampled_from(sorted(KINDS)),
    st.integers(1, 150),
    st.integers(0, 3),
)
def test_no_lost_frozen_or_spoilt_stream_is_trusted_more_than_an_honest_absence(
    kind: str, name: str, ticks: int, seed: int
) -> None:
    """Honest: the detector says from the same time on that there is nothing, and is believed."""
    table = {"kind": kind, "from_s": ticks / 100}
    table |= {"detector": name} if kind == "crash" else {"channel": f"body/{name}"}
    if kind == "delay":
        table["magnitude"] = 0.2  # beyond the max_age of 0.1 s
    faulty = run("shadow", table, seed=seed)
    honest = run("shadow", seed=seed, using=registry(name, ticks * 10 * MS - 1))
    for column in ("control_trust", "trust"):
        worse = zip(faulty.series[column], honest.series[column], strict=True)
        assert all(not f > h + 1e-12 for f, h in worse), column  # rounding of P is 1e-9 at most; equal in fact
    assert any(h.source == name and h.state in ("unobserved", "failed") for h in faulty.health)


def test_a_frozen_stream_is_noticed_where_its_reader_declares_a_standstill_and_nowhere_else() -> None:
    """Where none is declared it is trusted as much as an honest absence, while the robot falls."""
    table = {"kind": "freeze", "channel": "*", "from_s": 0.1}
    assert run("on", table).max_level == 3
    frozen = run("on", table, using=registry(still_s=0.0))
    assert frozen.accident
    assert frozen.max_level == 0
    assert min(frozen.series["control_trust"]) == 1.0
    assert not any(h.state in ("unobserved", "failed", "stale") and h.stamp_ns > 100 * MS for h in frozen.health)
    assert run("on", {"kind": "dropout", "channel": "*", "from_s": 0.1}).max_level == 3, "silence is noticed"


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"kind": "freze", "channel": "*"}, "faults[0].kind: 'freze' is not one of 'dropout', 'loss'"),
        ({"channel": "*"}, "faults[0].kind: missing"),
        ({"kind": 3}, "faults[0].kind: 3 is not one of"),
        ({"kind": "freeze", "chanel": "*"}, "chanel: unknown key; did you mean 'channel'?"),
        ({"kind": "freeze", "channel": "*", "magnitude": 1.0}, "magnitude: unknown key"),
        ({"kind": "freeze"}, "missing required field `channel`"),
        ({"kind": "delay", "channel": "*", "magnitude": -1.0}, "faults.delay.magnitude: -1.0 is not"),
        ({"kind": "delay", "channel": "*", "magnitude": 1.0, "unit": "ms"}, "'ms' is not one of 's'"),
        ({"kind": "loss", "channel": "*", "probability": 1.5}, "faults.loss.probability: 1.5 is not"),
        ({"kind": "nan", "channel": "*", "from_s": 2.0, "until_s": 1.0}, "faults.nan.until_s: 1.0 is not"),
        (
            {"kind": "bias", "channel": "*", "fields": ["data"], "magnitude": math.nan, "unit": "1"},
            "faults.bias.magnitude: nan is not a finite number",
        ),
        ({"kind": "noise", "channel": "*", "fields": [], "magnitude": 1.0, "unit": "1"}, "faults.noise.fields: empty"),
    ],
)
def test_a_declaration_is_checked(table: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        faults(table)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"kind": "freeze", "channel": "body/leen"}, "a1-lean: faults[0].channel: 'body/leen' matches no channel"),
        ({"kind": "freeze", "channel": "body/leen"}, "did you mean 'body/lean'"),
        ({"kind": "late", "actions": ["balance-lok"], "magnitude": 1.0}, "did you mean 'balance-lock'"),
        ({"kind": "crash", "detector": "leen"}, "faults[0].detector: no detector 'leen' runs; did you mean 'lean'?"),
        (
            {"kind": "bias", "channel": "*", "fields": ["dat"], "magnitude": 1.0, "unit": "1"},
            "faults[0].fields: Scalar has no field 'dat'; did you mean 'data'?",
        ),
    ],
)
def test_a_fault_must_fit_twin_and_supervisor(table: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        run("on", table)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("type_", "text", "unit", "message"),
    [
        (Imu, "angular_velocity[3]", "rad/s", "no element 3; there are 3"),
        (Imu, "angular_velocity", "m", "is in rad/s, the fault in 'm'"),
        (Imu, "frame_id", "m", "is no measured number"),
        (Humans, "humans", "m", "go on with .velocity or .uncertainty"),
        (Humans, "humans.capsules.c", "m", "Capsule has no field 'c'"),
        (Odometry, "position.x", "m", "goes on after a number"),
        (Odometry, "position[", "m", "is no field"),
        (Scalar, "data[0]", "m", "has an index, but is a single value"),
    ],
)
def test_a_field_must_exist_and_have_the_unit(type_: type, text: str, unit: str, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        path_in(type_, text, unit, "place")
    assert message in str(caught.value)


def test_a_path_changes_what_it_names() -> None:
    joints = JointState(("a", "b"), (1.0, 2.0), (3.0, 4.0))
    assert changed(joints, path_in(JointState, "position[1]", "rad", ""), lambda x: x + 1.0).position == (1.0, 3.0)
    assert changed(joints, path_in(JointState, "effort", "N m", ""), lambda x: x + 1.0) == joints, "not measured"
    with pytest.raises(ConfigError, match=r"position\[7\] is not there: JointState carries 2"):
        changed(joints, path_in(JointState, "position[7]", "rad", ""), lambda x: x)


def test_a_scenario_file_declares_faults(tmp_path) -> None:
    path = tmp_path / "s.toml"
    path.write_text(
        'id = "s"\ntitle = "t"\nmode = "A1"\nexpect = "open"\nduration_s = 1.0\n[twin]\nkind = "fmu"\n[config]\n'
        '[[faults]]\nkind = "noise"\nchannel = "*/imu"\nfields = ["angular_velocity[0]"]\nmagnitude = 0.2\n'
        'unit = "rad/s"\n[[faults]]\nkind = "crash"\ndetector = "balance"\nfrom_s = 2.0\n'
    )
    assert load_scenario(path).faults == faults(
        {"kind": "noise", "channel": "*/imu", "fields": ["angular_velocity[0]"], "magnitude": 0.2, "unit": "rad/s"},
        {"kind": "crash", "detector": "balance", "from_s": 2.0},
    )
    path.write_text(path.read_text().replace('"noise"', '"nose"'))
    with pytest.raises(ConfigError, match=r"s\.toml: faults\[0\]\.kind: 'nose' is not one of .*did you mean 'noise'"):
        load_scenario(path)
