"""The four kinds of the navigation detector, each on what it means and on what looks like it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import pytest
from crossing_walkers import RADIUS_M, Place, encounter, straight

from foreshock.detector import Inputs
from foreshock.errors import ConfigError
from foreshock.messages import Humans, PlannedPath
from foreshock.records import Indication, Sample
from foreshock_detectors import navigation
from foreshock_detectors.navigation import NavigationConfig
from foreshock_detectors.navigation._approach import Approach
from foreshock_detectors.navigation._encounter import encounter as closest
from foreshock_detectors.navigation._overlap import least_gap_s

(SPEC,) = navigation.foreshock_detectors()
CONVERGES, OVERLAPS, FAST, NARROW = SPEC.kinds
NAMES = {"base/odometry": "odometry", "plan/path": "path", "humans/pose": "humans", "foot/odometry": "foot"}
ROBOT = straight(0.0, 0.0, 0.9, 0.0)
History = list[tuple[float, dict[str, Indication]]]


def play(samples: Sequence[Sample], config: NavigationConfig | None = None) -> History:
    """Time and indications by kind of every update."""
    detector, latest, history = SPEC.build(config or NavigationConfig()), {}, []
    ticks: dict[int, list[Sample]] = {}
    for s in samples:
        ticks.setdefault(s.stamp_ns, []).append(s)
    for now, arrived in sorted(ticks.items()):
        new: dict[str, list[Sample]] = {}
        for s in arrived:
            name = NAMES[s.channel.partition("/")[2]]
            new.setdefault(name, []).append(s)
            latest[name] = s
        history.append((now * 1e-9, {i.kind: i for i in detector.update(now, Inputs(dict(latest), new))}))
    return history


def found(samples: Sequence[Sample], config: NavigationConfig | None = None) -> dict[str, float]:
    """First time of each kind."""
    first: dict[str, float] = {}
    for t, said in play(samples, config):
        for kind, i in said.items():
            if i.present:
                first.setdefault(kind, t)
    return first


def across(late_s: float = 0.0, speed: float = 1.4) -> Place:
    """A human who crosses the robot's line from the left, 6 s from the start, where the robot is then as well."""
    return straight(5.4, speed * (6.0 + late_s), 0.0, -speed)


def test_a_collision_course_shows_all_in_the_order_of_their_horizons() -> None:
    first = found(encounter(ROBOT, across(), 5.6))
    assert set(first) == set(SPEC.kinds)
    assert first[CONVERGES] < first[OVERLAPS] < first[FAST] < first[NARROW]
    config, touch = NavigationConfig(), 6.0 - (config_radii() / math.hypot(0.9, 1.4))
    assert 6.0 - config.convergence_s < first[CONVERGES] < 6.0 - config.convergence_s + 1.0
    # allowed speed = (gap - C) / T: a constant closing speed c exceeds it from the gap c T + C on
    closing = math.hypot(0.9, 1.4)
    due = touch - (config.reaction_s + config.stopping_s) - config.intrusion_m / closing
    assert first[FAST] == pytest.approx(due, abs=0.2)
    assert touch - first[FAST] > config.stopping_s


def config_radii() -> float:
    return NavigationConfig().robot_radius_m + RADIUS_M


def test_ten_minutes_of_parallel_walking_are_silent() -> None:
    """Side by side at 1.3 m, the human weaving by 0.1 m: closing now and then, never converging."""

    def beside(t: float) -> tuple[float, float]:
        return 1.5 + 0.9 * t + 0.2 * math.sin(0.9 * t), 1.3 + 0.1 * math.sin(1.7 * t)

    assert found(encounter(ROBOT, beside, 600.0, seed=3)) == {}


def test_one_who_passes_well_before_the_robot_is_no_convergence() -> None:
    assert CONVERGES not in found(encounter(ROBOT, across(-2.0), 8.0))


def test_paths_that_cross_at_different_times_do_not_overlap() -> None:
    """Post-encroachment time: 2.6 s less what both take through the place where they cross."""
    both_m = config_radii() + NavigationConfig().overlap_margin_m
    assert 2.6 - both_m / 0.9 - both_m / 1.4 > NavigationConfig().gap_s
    assert found(encounter(ROBOT, across(-2.6), 8.0)) == {}
    assert OVERLAPS in found(encounter(ROBOT, across(-1.2), 8.0))


def test_a_human_who_stops_well_before_the_lane_does_not_overlap() -> None:
    def stops(t: float) -> tuple[float, float]:
        return 5.4, max(1.4 * (6.0 - t), 4.2)

    assert OVERLAPS not in found(encounter(ROBOT, stops, 9.0))


def test_a_fast_human_who_moves_away_or_passes_aside_is_no_high_approach_speed() -> None:
    assert FAST not in found(encounter(ROBOT, straight(1.0, 0.0, 2.5, 0.0), 4.0))
    assert FAST not in found(encounter(ROBOT, straight(9.0, 1.8, -2.5, 0.0), 5.0))
    assert FAST in found(encounter(ROBOT, straight(9.0, 0.0, -2.5, 0.0), 2.3))


def test_room_beside_the_path() -> None:
    def beside(gap_m: float) -> Place:
        return straight(4.0, config_radii() + gap_m, 0.0, 0.0)

    assert NARROW in found(encounter(ROBOT, beside(0.3), 5.0))
    assert NARROW not in found(encounter(ROBOT, beside(0.7), 5.0))


def test_a_robot_that_means_to_stand_shares_no_room() -> None:
    still = straight(0.0, 0.0, 0.0, 0.0)
    assert found(encounter(still, straight(0.9, 0.0, 0.0, 0.0), 3.0)) == {}


def test_a_wall_behind_the_human_takes_room_away() -> None:
    human = straight(4.0, config_radii() + 0.53, 0.0, 0.0)
    behind = config_radii() + 0.53 + RADIUS_M
    config = NavigationConfig(walls=((0.0, behind + 0.03, 10.0, behind + 0.03),))
    assert NARROW in found(encounter(ROBOT, human, 5.0, noise_m=0.002), config)
    assert NARROW not in found(encounter(ROBOT, human, 5.0, noise_m=0.002))


def test_a_limb_off_the_lane_counts_as_it_is() -> None:
    config = NavigationConfig(limbs={"foot": 0.06}, free_least_m=0.18, robot_radius_m=0.15)
    human = straight(4.0, 0.15 + RADIUS_M + 0.25, 0.0, 0.0)
    lane = straight(0.0, 0.0, 0.9, 0.0)
    for aside, narrow in ((0.09, False), (0.22, True)):
        first = found(encounter(lane, human, 5.0, limb=straight(0.0, aside, 0.9, 0.0)), config)
        assert (NARROW in first) is narrow


def test_one_who_goes_out_of_sight_is_predicted_on_and_then_has_left() -> None:
    config = NavigationConfig()
    history = play(encounter(ROBOT, across(), 5.3, sight=lambda t: t < 3.9), config)
    at = {round(t, 2): said for t, said in history}
    assert at[4.9][CONVERGES].present
    assert at[4.9][OVERLAPS].present
    subjects = [said[CONVERGES].subject for t, said in history if t > 3.9 + config.coast_s]
    assert set(subjects) <= {"human-1"}


def unmeasured(samples: Sequence[Sample]) -> list[Sample]:
    """The same from a tracker that reports no velocity."""

    def without(value: Humans) -> Humans:
        return Humans(tuple(msgspec.structs.replace(h, velocity=None) for h in value.humans))

    return [msgspec.structs.replace(s, value=without(s.value)) if isinstance(s.value, Humans) else s for s in samples]


def test_one_who_steps_out_close_by_is_judged_at_once_by_his_reported_velocity() -> None:
    """He comes into view at 5.0 s, 1 s before they meet: the dwell times of 0.04 s and 0.12 s remain."""
    samples = encounter(ROBOT, across(), 5.6, sight=lambda t: t > 4.99)
    history = play(samples)
    seen = next(t for t, said in history if said and said[FAST].subject)
    assert all(set(said) == set(SPEC.kinds) for t, said in history if t >= seen)
    first = found(samples)
    assert first[FAST] - seen < 0.1
    assert first[OVERLAPS] - seen < 0.18


def test_what_rests_on_a_velocity_that_is_not_known_yet_is_unobserved() -> None:
    history = play(unmeasured(encounter(ROBOT, across(), 5.8, sight=lambda t: t > 4.99)))
    unknown = [t for t, said in history if set(said) == {NARROW}]
    assert unknown[0] == pytest.approx(5.0, abs=0.04)
    assert unknown[-1] - unknown[0] == pytest.approx(2.0 * NavigationConfig().velocity_time_s, abs=0.05)
    later = [said for t, said in history if t > unknown[-1]]
    assert all(set(said) == set(SPEC.kinds) for said in later)
    assert later[-1][FAST].present


def test_nobody_is_absent_beside_one_whose_velocity_is_not_known_yet() -> None:
    """A second human, far aside, appears without a velocity at 2 s."""
    samples = encounter(ROBOT, straight(0.0, 9.0, 0.0, 0.0), 3.0)
    other = unmeasured(encounter(ROBOT, straight(0.0, -9.0, 0.0, 0.0), 3.0, sight=lambda t: t > 1.99))
    both = []
    for s, o in zip(samples, other, strict=True):
        value = s.value
        if isinstance(value, Humans) and isinstance(o.value, Humans):
            second = tuple(msgspec.structs.replace(h, id="human-2") for h in o.value.humans)
            value = Humans(value.humans + second)
        both.append(msgspec.structs.replace(s, value=value))
    partial = [t for t, said in play(both) if set(said) == {NARROW}]
    assert partial[0] == pytest.approx(2.0, abs=0.04)
    assert partial[-1] == pytest.approx(2.4, abs=0.06)


def test_nobody_there_is_absence_and_a_missing_input_is_not() -> None:
    empty = encounter(ROBOT, across(), 1.0, sight=lambda t: False)
    assert all(not i.present and i.subject == "" for _, said in play(empty)[1:] for i in said.values())
    assert {k for _, said in play(empty) for k in said} == set(SPEC.kinds)
    for channel in ("base/odometry", "plan/path", "humans/pose"):
        rest = [s for s in encounter(ROBOT, across(), 1.0) if not s.channel.endswith(channel)]
        assert not any(said for _, said in play(rest))


def test_an_orientation_that_is_no_rotation_is_an_error_and_not_level() -> None:
    samples = encounter(ROBOT, across(), 1.0)
    spoiled = [
        msgspec.structs.replace(s, value=msgspec.structs.replace(s.value, orientation=(0.0, 0.0, 0.0, 0.0)))
        if s.channel.endswith("base/odometry")
        else s
        for s in samples
    ]
    with pytest.raises(ValueError, match="no rotation"):
        play(spoiled)


def test_speed_that_falls_a_little_below_the_threshold_stays_high() -> None:
    # allowed is (1.5 - 0.1) / 1.4 = 1 m/s; 0.9 is within the hysteresis of 0.8, 0.7 is not
    for later, stands in ((0.9, True), (0.7, False)):
        judge = Approach(NavigationConfig())
        for k in range(50):
            judge.push(closest(1.5, 0.0, -(1.2 if k < 4 else later), 0.0, 0.0), 20_000_000 * k)
        assert judge.present is stands


def test_closest_approach_in_closed_form() -> None:
    """Right-angled approach: both 3 m and 4 m from the crossing at 1 m/s; |d| is least 3.5 s on, at 1 / sqrt 2 m."""
    met = closest(3.0, 4.0, -1.0, -1.0, 0.5)
    assert met.gap_m == pytest.approx(4.5)
    assert met.closing_m_s == pytest.approx(7.0 / 5.0)
    assert met.time_s == pytest.approx(3.5)
    assert met.miss_m == pytest.approx(math.sqrt(0.5) - 0.5)
    assert closest(3.0, 4.0, 1.0, 1.0, 0.5).time_s == 0.0


def test_encroachment_gap_in_closed_form() -> None:
    """The human is within 0.6 m of (2, 0) from 2.4 s to 3.6 s; the robot is there at 1 s or at 5 s."""
    for at_s, gap in ((1.0, 1.4), (3.0, 0.0), (5.0, 1.4)):
        path = PlannedPath((2.0,), (0.0,), (at_s,))
        assert least_gap_s(path, 0.0, 2.0, 3.0, 0.0, -1.0, ((0.0, 0.0, 0.2),), 0.4, 9.0) == pytest.approx(gap)
    assert (
        least_gap_s(PlannedPath((9.0,), (0.0,), (1.0,)), 0.0, 2.0, 3.0, 0.0, -1.0, ((0.0, 0.0, 0.2),), 0.4, 9.0)
        == math.inf
    )


@pytest.mark.parametrize(
    ("settings", "place"),
    [
        ({"limbs": {"humans": 0.1}}, "limbs"),
        ({"limbs": {"foot": 0.0}}, "limbs.foot"),
        ({"walls": ((0.0, 0.0, 0.0, 0.0),)}, "walls"),
        ({"gap_s": math.nan}, "gap_s"),
        ({"reaction_s": 0.0}, "reaction_s"),
    ],
)
def test_a_bad_setting_is_named(settings: dict[str, object], place: str) -> None:
    with pytest.raises(ConfigError, match=f"navigation.{place}"):
        NavigationConfig(**settings)  # type: ignore[arg-type]
