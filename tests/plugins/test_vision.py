"""The vision detector: fires on its definitions, is silent on their look-alikes and for an hour of nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
from vision_stream import Thing, always, frames, named, pictures

from foreshock.detector import Inputs
from foreshock.errors import ConfigError
from foreshock.messages import Detection, Detections
from foreshock.records import Indication, Sample
from foreshock.testing import Rig
from foreshock_detectors import vision
from foreshock_detectors.vision import VisionConfig
from foreshock_detectors.vision._image import LEARNT

SPEC = vision.foreshock_detectors()[0]
TRACKS = tuple(k for k in SPEC.kinds if k != "visual-degradation")


def played(samples: Sequence[Sample], config: VisionConfig | None = None) -> list[tuple[float, Indication]]:
    """(time, indication) of all that a detector says, one update per instant."""
    detector = SPEC.build(config or VisionConfig())
    out, latest = [], {}
    by_time: dict[int, list[Sample]] = {}
    for s in samples:
        by_time.setdefault(s.stamp_ns, []).append(s)
    for now in sorted(by_time):
        new = {}
        for s in by_time[now]:
            name = s.channel.rsplit("/", 1)[1]
            new[name], latest[name] = (s,), s
        out += [(now * 1e-9, i) for i in detector.update(now, Inputs(dict(latest), new))]
    return out


def present(said: Sequence[tuple[float, Indication]]) -> dict[str, float]:
    """Kind -> when it was first present (s)."""
    found: dict[str, float] = {}
    for t, i in said:
        if i.present:
            found.setdefault(i.kind, t)
    return found


def step(at: float, before: float, after: float) -> object:
    return lambda t: before if t < at else after


def ramp(at: float, span: float, before: float, after: float) -> object:
    return lambda t: before + (after - before) * min(max((t - at) / span, 0.0), 1.0)


# --- occlusion


def test_a_person_who_is_mostly_hidden_is_occluded_and_clear_again() -> None:
    said = played(frames([named("p1", "human", visible=lambda t: 0.4 if 2.0 <= t < 3.0 else 0.95)], 5.0))
    assert present(said).keys() == {"visual-occlusion"}
    when = [t for t, i in said if i.kind == "visual-occlusion" and i.present]
    assert when[0] == pytest.approx(2.0, abs=0.06)  # the median of three frames
    assert when[-1] == pytest.approx(3.0 + VisionConfig().hold_s, abs=0.06)


def test_a_person_who_vanishes_in_view_is_occluded_and_one_who_walks_out_is_not() -> None:
    """Both are lost at 3 s; one behind a pillar at y = 0, one at the edge of the view."""
    config = VisionConfig(view=(0.0, -2.0, -1.0, 6.0, 2.0, 3.0))
    behind = named("p1", "human", y=lambda t: -1.5 + 0.5 * t, there=lambda t: t < 3.0)
    said = played(frames([behind], 6.0), config)
    assert present(said)["visual-occlusion"] == pytest.approx(3.0 + config.lost_s, abs=0.03)
    assert max(t for t, i in said if i.present) == pytest.approx(6.0)  # not seen again: still there, hidden
    out = named("p1", "human", y=lambda t: -1.8 + 1.2 * t, there=lambda t: t < 3.0)
    assert present(played(frames([out], 6.0), config)) == {}


def test_a_person_who_changed_course_behind_a_pillar_is_the_same_when_seen_again() -> None:
    """Walks at 1 m/s into it, stops there for 1.5 s unseen, and comes back out 1.5 m off the predicted place."""
    walker = named("p1", "human", y=lambda t: min(t, 2.0) - 1.0, there=lambda t: not 2.0 <= t < 3.5)
    said = played(frames([walker], 5.0))
    assert present(said).keys() == {"visual-occlusion"}
    mine = [i for t, i in said if i.kind == "visual-occlusion" and i.subject == "p1"]
    assert not mine[-1].present
    stamps = {i.stamp_ns for i in mine}
    assert stamps >= {i.stamp_ns for _, i in said if i.stamp_ns > 1_000_000_000}  # spoken of without a gap


def test_a_ghost_of_a_few_frames_is_nobody_who_could_be_hidden() -> None:
    ghost = named("g", "human", there=lambda t: 2.0 <= t < 2.2)
    assert present(played(frames([named("p1", "human", x=always(4.0)), ghost], 5.0))) == {}


def test_an_object_under_a_tracked_hand_is_covered_on_purpose_but_a_hand_that_vanishes_is_occluded() -> None:
    def scene(hand_seen: bool) -> list[Sample]:
        hand = named("hand", "hand", x=ramp(1.5, 0.5, 1.5, 1.95), visible=always(0.9))
        hidden = named("hand", "hand", x=always(1.95), there=lambda t: t < 2.5)
        box = named("box", "object", x=always(2.0), visible=step(2.0, 1.0, 0.3 if hand_seen else 0.95))
        return frames([hand if hand_seen else hidden, box], 4.0)

    config = VisionConfig(handover_zone=(1.0, -0.5, 0.5, 3.0, 0.5, 1.5))
    assert present(played(scene(hand_seen=True), config)) == {}
    assert present(played(scene(hand_seen=False), config)).keys() == {"handover-occlusion"}
    elsewhere = VisionConfig(handover_zone=(3.0, -0.5, 0.5, 4.0, 0.5, 1.5))
    assert present(played(scene(hand_seen=False), elsewhere)) == {}


# --- confidence


def test_confidence_that_falls_at_once_collapses_and_is_low() -> None:
    found = present(played(frames([named("p1", "human", confidence=ramp(2.0, 0.3, 0.9, 0.35))], 4.0)))
    assert found.keys() == {"confidence-collapse", "low-vision-confidence"}
    # Drop 0.25 beyond 0.3/s, at 1.83/s: 0.163 s, and two frames of the median of five.
    assert found["confidence-collapse"] == pytest.approx(2.0 + 0.25 / (0.55 / 0.3 - 0.3) + 0.04, abs=0.05)


def test_confidence_that_falls_slowly_is_low_but_no_collapse() -> None:
    found = present(played(frames([named("p1", "human", confidence=ramp(2.0, 2.5, 0.9, 0.3))], 6.0)))
    assert found.keys() == {"low-vision-confidence"}


@pytest.mark.parametrize("dip", [1, 2])
def test_a_dip_of_one_or_two_frames_is_no_collapse(dip: int) -> None:
    course = lambda t: 0.1 if 2.0 <= t < 2.0 + dip / 50.0 - 1e-6 else 0.9  # noqa: E731
    assert present(played(frames([named("p1", "human", confidence=course)], 4.0))) == {}


def test_confidence_that_always_flickers_must_fall_further() -> None:
    """A square wave of +-0.15 at half the frame rate is its own scatter."""
    flicker = lambda t: 0.75 + (0.15 if round(50 * t) % 2 else -0.15)  # noqa: E731
    assert "confidence-collapse" not in present(played(frames([named("p1", "human", confidence=flicker)], 10.0)))


# --- identity and class


def test_another_id_at_the_same_place_is_a_switch_and_swapped_ids_are_two() -> None:
    renamed = Thing(lambda t: "p1" if t < 2.0 else "p7", lambda t: "human", y=lambda t: 0.5 * t)
    said = played(frames([renamed], 4.0))
    assert present(said) == {"id-switching": pytest.approx(2.0, abs=0.03)}
    swap = [
        Thing(lambda t: "a" if t < 2.0 else "b", lambda t: "human", y=always(0.4)),
        Thing(lambda t: "b" if t < 2.0 else "a", lambda t: "human", y=always(-0.4)),
    ]
    assert {i.subject for _, i in played(frames(swap, 4.0)) if i.present} == {"a", "b"}


def test_people_who_pass_each_other_or_come_new_switch_nothing() -> None:
    walkers = [
        named("a", "human", y=lambda t: -2.0 + t),
        named("b", "human", x=always(2.3), y=lambda t: 2.0 - t),
        named("c", "human", x=always(2.4), y=always(0.1), there=lambda t: t >= 2.5),
    ]
    assert present(played(frames(walkers, 5.0))) == {}


def test_a_forearm_taken_for_a_tool_is_found_and_one_wrong_frame_is_not() -> None:
    def arm(wrong: object) -> Thing:
        return Thing(lambda t: "arm", lambda t: "tool" if wrong(t) else "forearm", x=always(1.0))

    flicker = arm(lambda t: t >= 2.0 and round(50 * t) % 4 == 0)
    said = played(frames([flicker, named("t", "tool", x=always(1.4))], 4.0))
    assert present(said) == {"limb-tool-misclassification": pytest.approx(2.0 + 8 / 50.0, abs=0.12)}
    assert {i.subject for _, i in said if i.present} == {"arm"}
    once = arm(lambda t: round(50 * t) % 100 == 0)
    assert present(played(frames([once], 20.0))) == {}
    finer = Thing(lambda t: "arm", lambda t: "hand" if round(50 * t) % 2 else "forearm")  # both are limbs
    assert present(played(frames([finer], 4.0))) == {}


# --- the image


def test_fog_that_takes_contrast_is_degradation_long_before_nothing_is_seen() -> None:
    """Optical depth grows by 0.5 per s from 3 s on; a quarter of the contrast is lost at tau = 0.288."""
    fog = lambda t: 0.25 * math.exp(-0.5 * max(0.0, t - 3.0))  # noqa: E731
    found = present(played(pictures(8.0, contrast=fog)))
    assert found.keys() == {"visual-degradation"}
    assert 3.0 + 0.288 / 0.5 < found["visual-degradation"] < 3.0 + 2 * 0.288 / 0.5


def test_blur_and_glare_are_degradation() -> None:
    assert present(played(pictures(5.0, sharpness=step(3.0, 0.8, 0.4)))).keys() == {"visual-degradation"}
    assert present(played(pictures(5.0, saturated=step(3.0, 0.01, 0.5)))).keys() == {"visual-degradation"}


def test_until_the_reference_is_learnt_the_limits_alone_judge_and_the_warm_up_covers_it() -> None:
    """From the first image on nothing can be seen; or half of the contrast is lost just after it is learnt."""
    dark = played(pictures(0.4, contrast=always(0.04)))
    assert dark[0][0] == pytest.approx(0.06)  # the median of three: before, unobserved
    assert all(i.present for _, i in dark)
    assert present(played(pictures(3.0, contrast=step(LEARNT / 50.0 + 0.01, 0.25, 0.12)))) != {}
    assert SPEC.warm_up_s >= LEARNT / 50.0  # frame_s is 0.02


def test_a_lamp_one_black_frame_and_a_slow_dusk_are_not() -> None:
    assert present(played(pictures(8.0, luminance=step(3.0, 0.5, 0.2)))) == {}
    black = lambda t: 0.0 if abs(t - 3.0) < 0.005 else 0.25  # noqa: E731
    assert present(played(pictures(8.0, contrast=black))) == {}
    dusk = lambda t: 0.25 * (1.0 - 0.3 * t / 600.0)  # noqa: E731
    assert present(played(pictures(600.0, contrast=dusk, rate_hz=10.0))) == {}


# --- what is not observed


def test_half_an_hour_of_nothing_says_nothing() -> None:
    """30 min at 10 Hz and 4 min at 50 Hz of two people and a tool, heavy tails included."""
    for rate_hz, seconds in ((10.0, 1800.0), (50.0, 240.0)):
        things = [
            named("p1", "human", y=lambda t: math.sin(0.7 * t), confidence=always(0.85)),
            named("p2", "human", x=always(4.0), visible=always(0.9)),
            named("tool", "tool", x=always(1.0)),
        ]
        samples = [*frames(things, seconds, rate_hz, seed=3), *pictures(seconds, rate_hz=rate_hz, seed=4)]
        assert present(played(samples, VisionConfig(frame_s=1.0 / rate_hz))) == {}


def test_without_statistics_degradation_is_unobserved_and_a_malformed_frame_says_nothing() -> None:
    samples = frames([named("p1", "human")], 1.0)
    assert {i.kind for _, i in played(samples)} == set(TRACKS)
    bad = Detections((Detection("p1", "human", 1.2, (0.0, 0.0, 0.0)),))
    detector = SPEC.build(VisionConfig())
    sample = Sample(10**9, "talos/vision/detections", bad)
    assert detector.update(10**9, Inputs({"detections": sample}, {"detections": (sample,)})) == []


def test_only_the_kinds_that_are_wanted_are_reported_and_their_channels_read() -> None:
    config = VisionConfig(kinds=("visual-occlusion", "id-switching"))
    assert [i.name for i in vision.inputs(config)] == ["detections"]
    assert [i.name for i in vision.inputs(VisionConfig(kinds=("visual-degradation",)))] == ["statistics"]
    play = Rig(SPEC, config, tick_s=0.02).play(frames([named("p1", "human")], 1.5))
    assert {i.kind for d in play.decisions for i in d.indications} == {"visual-occlusion", "id-switching"}
    assert play.decisions[-1].trust.unobserved == ()
    assert play.decisions[-1].trust.coverage == 1.0


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"kinds": ("visual-oclusion",)}, ["vision.kinds", "visual-oclusion", "did you mean 'visual-occlusion'"]),
        ({"kinds": ()}, ["vision.kinds", "at least one"]),
        ({"visible_least": 0.9}, ["vision.visible_release", "0.75"]),
        ({"collapse_drop": -1.0}, ["vision.collapse_drop", "-1.0"]),
        ({"tool_classes": ("hand",)}, ["vision.tool_classes", "'hand'"]),
        ({"view": (0.0, 0.0, 0.0, 1.0, -1.0, 1.0)}, ["vision.view", "-1.0"]),
    ],
)
def test_wrong_settings_are_named(settings: dict[str, object], says: list[str]) -> None:
    with pytest.raises(ConfigError) as caught:
        VisionConfig(**settings)
    assert [part for part in says if part not in str(caught.value)] == []
