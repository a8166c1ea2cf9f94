"""The telemetry detector: fires on its definitions, is silent on their look-alikes, keeps its false alarm rate."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
import pluggy
import pytest
from scipy import stats

from foreshock import hookspecs
from foreshock.detector import Detector, Inputs
from foreshock.errors import ConfigError
from foreshock.messages import Heartbeat, Scalar
from foreshock.records import Indication, Sample
from foreshock.taxonomy import builtin_taxonomy
from foreshock_detectors import telemetry
from foreshock_detectors.telemetry import TelemetryConfig

MS = 1_000_000
SPEC = telemetry.foreshock_detectors()[0]
SPIKE, DELAY, DROPOUT, REORDER = SPEC.kinds
BASE = 3 * MS


def message(
    i: int, latency_ms: float = 3.0, period_ms: float = 5.0, channel: str = "joints/state", seq: int | None = None
) -> Sample:
    """The i-th message of a periodic channel."""
    stamp = 1_000 * MS + round(i * period_ms * MS)
    return Sample(stamp, f"talos/{channel}", Scalar(0.0), i if seq is None else seq, stamp + round(latency_ms * MS))


def play(
    detector: Detector, samples: Iterable[Sample], until_ms: float = 0.0, tick_ms: float = 5.0
) -> list[tuple[int, dict[str, Indication]]]:
    """Deliver samples in order of arrival to a detector that ticks; one entry per tick that said something."""
    pending = sorted(samples, key=lambda s: s.received_ns)
    now, tick = pending[0].received_ns, round(tick_ms * MS)
    end = max(pending[-1].received_ns + tick, round(until_ms * MS))
    out, k = [], 0
    while now < end:
        now += tick
        first = k
        while k < len(pending) and pending[k].received_ns <= now:
            k += 1
        said = detector.update(now, Inputs({}, {"any": tuple(pending[first:k])}))
        if said:
            out.append((now, {i.kind: i for i in said}))
    return out


def present(history: Sequence[tuple[int, dict[str, Indication]]]) -> set[str]:
    return {kind for _, said in history for kind, i in said.items() if i.present}


def detected(samples: Iterable[Sample], config: TelemetryConfig | None = None, until_ms: float = 0.0) -> set[str]:
    return present(play(SPEC.build(config or TelemetryConfig()), samples, until_ms))


def jittered(n: int, seed: int = 0, channels: int = 7, period_ms: float = 5.0) -> list[Sample]:
    """A healthy link: a fixed 2 ms and a gamma-distributed queue of mean 2 ms, in order per channel."""
    latency = 2.0 + np.random.default_rng(seed).gamma(2.0, 1.0, (n, channels))
    arrival = np.maximum.accumulate(latency + period_ms * np.arange(n)[:, None], axis=0)
    latency = arrival - period_ms * np.arange(n)[:, None]
    return [message(i, latency[i, c], period_ms, f"c{c}/state") for i in range(n) for c in range(channels)]


# --- spikes


def test_one_late_message_above_floor_and_scatter_is_a_spike() -> None:
    history = play(SPEC.build(TelemetryConfig()), [message(i, 43.0 if i == 200 else 3.0, 50.0) for i in range(400)])
    assert present(history) == {SPIKE}
    first = next(said[SPIKE] for _, said in history if said[SPIKE].present)
    assert first.statistic == pytest.approx(0.040, abs=1e-4)  # beyond the 3 ms that the link always takes
    assert first.threshold == 0.02
    assert first.subject == "robot"
    assert [(r.channel, r.stamp_ns) for r in first.evidence] == [("talos/joints/state", 1_000 * MS + 200 * 50 * MS)]
    assert not history[-1][1][SPIKE].present


def test_one_late_message_below_the_floor_is_not() -> None:
    assert detected([message(i, 21.0 if i == 200 else 3.0, 50.0) for i in range(400)]) == set()


def test_on_a_link_of_wide_scatter_the_limit_is_the_scatter() -> None:
    """Latency uniform on 0 .. 20 ms: median 10, MAD 5 ms, so that 8 robust deviations are 69 ms."""
    rng = np.random.default_rng(2)
    late = [float(rng.uniform(0.0, 20.0)) for _ in range(1200)]
    config = TelemetryConfig(reorder_events=10_000)
    assert detected([message(i, v) for i, v in enumerate(late)], config) == set()
    late[900] = 40.0
    assert SPIKE not in detected([message(i, v) for i, v in enumerate(late)], config)
    late[900] = 120.0
    assert SPIKE in detected([message(i, v) for i, v in enumerate(late)], config)


def test_a_slow_round_trip_of_the_control_loop_is_a_spike() -> None:
    def beats(trip_s: float) -> list[Sample]:
        out = []
        for i in range(300):
            stamp = i * 10 * MS
            value = Heartbeat(i, trip_s if i == 200 else 0.004)
            out.append(Sample(stamp, "talos/control/heartbeat", value, -1, stamp + MS))
        return out

    assert detected(beats(0.050)) == {SPIKE}
    assert detected(beats(0.015)) == set()
    assert detected(beats(0.0)) == set()  # measures none


def test_a_heartbeat_that_stands_still_is_silence() -> None:
    """Its messages go on with fresh stamps and numbers of their own; the sequence inside stays."""

    def beats(stuck: range) -> list[Sample]:
        return [
            Sample(
                i * 10 * MS, "talos/control/heartbeat", Heartbeat(stuck[0] if i in stuck else i, 0.004), i, i * 10 * MS
            )
            for i in range(300)
        ]

    def dropping(stuck: range) -> list[int]:
        history = play(SPEC.build(TelemetryConfig()), beats(stuck))
        return [now // MS for now, said in history if said[DROPOUT].present]

    assert dropping(range(200, 201)) == []
    # the last beat comes at 2.00 s: silent after ten periods of 10 ms, seen within one tick of 5 ms
    assert 2100 <= dropping(range(200, 300))[0] <= 2105
    twice = [s for s in beats(range(200, 201)) for _ in range(2)]
    assert detected(twice) == set(), "a transport that repeats a message is no sender that stands still"


# --- delay


def test_a_sustained_delay_is_found_and_ends() -> None:
    samples = [message(i, 83.0 if 200 <= i < 800 else 3.0) for i in range(1400)]
    history = play(SPEC.build(TelemetryConfig()), samples)
    at = [now for now, said in history if said[DELAY].present]
    began = samples[199].received_ns  # a late message says that it was late ever since the last one
    # The mean of a step of 80 ms crosses 50 ms after tau ln(80 / 30) = 0.49 s.
    assert at[0] - began == pytest.approx(0.5e9 * math.log(80 / 30), abs=30 * MS)
    assert not history[-1][1][DELAY].present
    assert history[-1][1][DELAY].statistic < 0.01


@pytest.mark.parametrize("offset_s", [-3600.0, -0.2, 0.2, 3600.0])
def test_a_constant_clock_offset_is_no_delay(offset_s: float) -> None:
    shift = round(offset_s * 1e9)
    samples = [
        Sample(s.stamp_ns + 10**13 + shift, s.channel, s.value, s.seq, s.received_ns + 10**13) for s in jittered(400)
    ]
    assert detected(samples) == set()


def test_clocks_that_drift_apart_are_no_delay_but_a_slow_rise_of_latency_beyond_that_is() -> None:
    """40 ppm over 25 min are 60 ms, within the allowed drift; 400 ppm over 3 min are 72 ms, beyond it."""

    def drifting(ppm: float, minutes: float) -> set[str]:
        samples = [message(i, 3.0 + i * 100.0 * ppm * 1e-6, 100.0) for i in range(round(minutes * 600))]
        return present(play(SPEC.build(TelemetryConfig()), samples, tick_ms=100.0))

    assert drifting(40.0, 25.0) == set()
    assert DELAY in drifting(400.0, 3.0)


def test_a_stamp_from_the_future_does_not_make_the_others_late() -> None:
    samples = [message(i) for i in range(600)]
    glitch = samples[300]
    samples[300] = Sample(glitch.stamp_ns + 10**10, glitch.channel, glitch.value, 300, glitch.received_ns)
    found = detected(samples)
    assert DELAY not in found
    assert SPIKE not in found
    assert REORDER in found  # the stamps went backwards after it


def test_the_known_base_latency_is_added() -> None:
    assert DELAY in detected([message(i) for i in range(600)], TelemetryConfig(base_latency_s=0.06))


# --- dropout


def test_lost_messages_are_counted_by_their_numbers() -> None:
    rng = np.random.default_rng(3)
    kept = [message(i) for i in range(2000) if rng.random() > 0.15]
    history = play(SPEC.build(TelemetryConfig()), kept)
    assert present(history) == {DROPOUT}
    loss = [said[DROPOUT].measures["loss"] for _, said in history[800:]]
    assert np.mean(loss) == pytest.approx(0.15, abs=0.02)  # fading window of 400 messages: sd 0.018, mean of many


def test_rare_losses_are_not_a_dropout() -> None:
    """1 % lost at random is below the 5 % limit; the fading fraction of 400 messages has a deviation of 0.5 %."""
    rng = np.random.default_rng(4)
    assert detected([message(i) for i in range(4000) if i < 50 or rng.random() > 0.01]) == set()


def test_one_lost_frame_of_a_slow_camera_is_not_a_dropout() -> None:
    kept = [message(i, period_ms=100.0) for i in range(100) if i != 50]
    assert detected(kept) == set()


def test_silence_is_a_dropout_even_if_nothing_ever_comes_again() -> None:
    samples = [message(i) for i in range(200)]
    last = samples[-1].received_ns
    history = play(SPEC.build(TelemetryConfig()), samples, until_ms=last / MS + 500)
    began = next(now for now, said in history if said[DROPOUT].present)
    assert 50 * MS <= began - last <= 60 * MS  # ten periods of 5 ms, and two ticks
    assert history[-1][1][DROPOUT].severity == 1.0
    assert history[-1][1][DROPOUT].present
    assert history[-1][1][DROPOUT].measures["silence_s"] == pytest.approx(0.5, abs=0.01)


def test_a_channel_without_numbers_is_still_heard_to_fall_silent() -> None:
    samples = [message(i, seq=-1) for i in range(200)]
    assert detected(samples) == set()
    assert detected(samples, until_ms=samples[-1].received_ns / MS + 200) == {DROPOUT}


def test_a_slower_channel_is_not_a_dropout() -> None:
    fast = [message(i) for i in range(1000)]
    slow = [message(i, period_ms=200.0, channel="camera/detections") for i in range(25)]
    assert detected(fast + slow) == set()


def test_a_channel_that_sends_on_events_may_be_silent() -> None:
    plan = [message(i, period_ms=50.0, channel="motion/plan") for i in range(20)]
    beat = [message(i) for i in range(1000)]
    assert detected(plan + beat) == {DROPOUT}
    assert detected(plan + beat, TelemetryConfig(aperiodic=("*/plan",))) == set()


def test_a_configured_period_needs_no_learning() -> None:
    config = TelemetryConfig(period_s={"joints/*": 0.005})
    assert detected([message(0)], config, until_ms=1_300) == {DROPOUT}


# --- order


def test_an_overtaken_message_is_reordering_and_no_loss() -> None:
    samples = [message(i) for i in range(400)]
    late = samples[200]
    samples[200] = Sample(late.stamp_ns, late.channel, late.value, late.seq, late.received_ns + 12 * MS)
    history = play(SPEC.build(TelemetryConfig()), samples)
    assert present(history) == {REORDER}
    assert history[-1][1][DROPOUT].measures["loss"] < 1e-6


def test_order_is_seen_by_stamps_where_there_are_no_numbers() -> None:
    samples = [message(i, seq=-1) for i in range(400)]
    late = samples[200]
    samples[200] = Sample(late.stamp_ns, late.channel, late.value, -1, late.received_ns + 12 * MS)
    assert detected(samples) == {REORDER}


@pytest.mark.parametrize("restart_at", [0, 3])
def test_a_restarted_sender_is_no_reordering(restart_at: int) -> None:
    samples = [message(i) for i in range(300)] + [message(300 + i, seq=restart_at + i) for i in range(300)]
    assert detected(samples) == set()


def test_a_counter_that_wraps_is_no_reordering_and_no_loss() -> None:
    assert detected([message(i, seq=(65_500 + i) % 65_536) for i in range(300)]) == set()


def test_numbers_that_jump_back_on_newer_stamps_are_reordering() -> None:
    samples = [message(i, seq=i + 5000 - (1000 if i >= 200 else 0)) for i in range(400)]
    assert detected(samples) == {REORDER}


def test_duplicates_are_nothing() -> None:
    samples = [message(i) for i in range(300)]
    copies = [Sample(s.stamp_ns, s.channel, s.value, s.seq, s.received_ns + MS) for s in samples[::3]]
    assert detected(samples + copies) == set()


def test_a_clock_set_back_is_said_once_and_then_delayed() -> None:
    """Nobody can tell a clock that was set back by 0.2 s from messages that are 0.2 s older: the delay stands."""
    samples = [message(i) for i in range(300)]
    samples += [
        Sample(s.stamp_ns - 200 * MS, s.channel, s.value, s.seq, s.received_ns) for s in map(message, range(300, 900))
    ]
    history = play(SPEC.build(TelemetryConfig()), samples)
    assert present(history) == {REORDER, DELAY, SPIKE}
    assert sum(said[REORDER].statistic for _, said in history[-50:]) == 0.0


# --- false alarms


def test_a_jittery_but_healthy_link_is_silent_for_an_hour() -> None:
    """An hour of 5 channels at 20 Hz: 360 000 latencies of 2 ms + gamma(2, 1 ms), ticks of 50 ms.

    A spike needs more than 20 ms beyond the least latency seen, which is no less than the fixed 2 ms. With the gamma's
    own tail, exp(-20) * 21 = 4e-8, that makes 0.02 alarms an hour: the bound is Poisson's 99.9 % quantile of that.
    """
    n, channels = 72_000, 5
    expected = n * channels * float(stats.gamma.sf(20.0, 2.0))
    allowed = int(stats.poisson.ppf(0.999, expected))
    history = play(SPEC.build(TelemetryConfig()), jittered(n, 5, channels, 50.0), tick_ms=50.0)
    onsets = 0
    for (_, before), (_, said) in pairwise(history):
        onsets += sum(said[kind].present and not before[kind].present for kind in SPEC.kinds)
    assert allowed <= 1
    assert onsets <= allowed


def test_a_jittery_link_at_full_rate_is_silent() -> None:
    assert detected(jittered(4000, 6)) == set()


# --- links, bad input, determinism


def test_one_network_fault_is_one_subject() -> None:
    config = TelemetryConfig(links={"wifi": ("camera/*", "human/*"), "bus": ("*",)})
    slow = ["camera/a", "camera/b", "human/pose"]
    samples = [message(i, 100.0 if i > 200 else 3.0, channel=c) for i in range(600) for c in slow]
    samples += [message(i) for i in range(640)]
    detector, seen = SPEC.build(config), set()
    for i in range(0, len(samples), 40):
        chunk = sorted(samples, key=lambda s: s.received_ns)[i : i + 40]
        said = detector.update(chunk[-1].received_ns, Inputs({}, {"any": chunk}))
        seen |= {(x.kind, x.subject) for x in said if x.present}
    assert seen == {(SPIKE, "wifi"), (DELAY, "wifi"), (DROPOUT, "wifi")}  # silent until the first late one came


def test_a_link_that_was_never_heard_leaves_all_unobserved() -> None:
    config = TelemetryConfig(links={"wifi": ("camera/*",), "bus": ("*",)})
    assert play(SPEC.build(config), [message(i) for i in range(100)]) == []


def test_nothing_is_said_until_silence_could_be_heard() -> None:
    history = play(SPEC.build(TelemetryConfig()), [message(i) for i in range(20)])
    assert history[0][0] >= message(9).received_ns
    assert SPEC.build(TelemetryConfig()).update(0, Inputs({}, {})) == ()


@pytest.mark.parametrize("trip", [math.nan, math.inf, -1.0])
def test_a_round_trip_that_is_no_time_leaves_all_unobserved(trip: float) -> None:
    detector = SPEC.build(TelemetryConfig())
    play(detector, [message(i) for i in range(100)])
    bad = Sample(2 * 10**9, "talos/control/heartbeat", Heartbeat(0, trip), 0, 2 * 10**9)
    assert detector.update(2 * 10**9, Inputs({}, {"any": (bad,)})) == ()


def test_samples_that_arrive_at_once_have_no_latency() -> None:
    samples = [Sample(i * 5 * MS, "talos/joints/state", Scalar(0.0), i) for i in range(300)]
    detector = SPEC.build(TelemetryConfig())
    for sample in samples:
        said = detector.update(sample.stamp_ns, Inputs({}, {"any": (sample,)}))
    assert [(i.present, i.statistic) for i in said] == [(False, 0.0)] * 4


def test_every_number_is_finite_and_severity_in_range() -> None:
    rng = np.random.default_rng(8)
    samples = [message(i, float(rng.exponential(60.0)), seq=int(rng.integers(0, 400))) for i in range(400)]
    for _, said in play(SPEC.build(TelemetryConfig()), samples):
        for i in said.values():
            assert all(map(math.isfinite, (i.statistic, i.threshold, i.severity, *i.measures.values())))
            assert 0.0 <= i.severity <= 1.0


def test_deterministic_and_reset_equals_new() -> None:
    samples = jittered(200, 9)
    used, fresh = SPEC.build(TelemetryConfig()), SPEC.build(TelemetryConfig())
    play(used, samples)
    used.reset(3)
    assert play(used, samples) == play(fresh, samples)


# --- set-up


@pytest.mark.parametrize(
    ("settings", "place"),
    [
        ({"links": {}}, "links"),
        ({"links": {"wifi": ()}}, "links.wifi"),
        ({"spike_floor_s": math.nan}, "spike_floor_s"),
        ({"period_s": {"joints/*": 0.0}}, "period_s.joints"),
        ({"loss_fraction": 1.0}, "loss_fraction"),
    ],
)
def test_a_bad_setting_is_named(settings: dict[str, object], place: str) -> None:
    with pytest.raises(ConfigError, match=f"telemetry.{place}"):
        TelemetryConfig(**settings)  # type: ignore[arg-type]


def test_the_plugin_registers_and_its_kinds_are_in_the_extended_taxonomy() -> None:
    manager = pluggy.PluginManager(hookspecs.GROUP)
    manager.add_hookspecs(hookspecs)
    manager.register(telemetry)
    manager.check_pending()
    (kinds,) = manager.hook.foreshock_precursors()
    taxonomy = builtin_taxonomy().extended(kinds)
    ((spec,),) = manager.hook.foreshock_detectors()
    for kind in spec.kinds:
        assert taxonomy.class_of(kind) == "system-telemetry"
        assert set(taxonomy.modes_of(kind)) >= {"A9", "A12"}  # Table 2
