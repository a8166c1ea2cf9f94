"""Configuration of the vision detector."""

from __future__ import annotations

import math
from typing import TypeAlias

import msgspec

from foreshock.errors import ConfigError, nearest

__all__ = ["KINDS", "Box", "VisionConfig"]

KINDS = (
    "visual-occlusion",
    "handover-occlusion",
    "low-vision-confidence",
    "confidence-collapse",
    "id-switching",
    "visual-degradation",
    "limb-tool-misclassification",
)

Box: TypeAlias = tuple[float, float, float, float, float, float]
"""x, y, z of the lower corner and of the upper corner (m), in the frame of the detections."""


class VisionConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings, with where each default comes from.

    Attributes:
        kinds: what is reported; leave out what the robot's channels cannot show, or it counts as unobserved.
        camera: subject of the kinds that are about the whole view: confidence and degradation.
        classes: classes that are tracked at all; empty is every class.
        occludable: classes whose occlusion is a visual occlusion.
        handover_classes: classes whose occlusion inside the handover zone is a handover occlusion.
        handover_zone: where objects change hands; none is everywhere.
        covering: classes that may cover an object on purpose: a tracked, visible hand that takes it.
        cover_m: so near to it (m); a hand is 0.19 m long (median adult, ISO 7250-3), its centre half of that away.
        view: box of what the camera sees; a track that vanishes at its edge has left. Without it none ever leaves.
        view_margin_m: a track within this of the edge has left (m): a walk of 1.4 m/s for lost_s.
        visible_least: occluded below this visible share; 0.65 begins "heavy occlusion" of the Caltech benchmark
            (Dollar et al., 2012, table 2), where the miss rate of pedestrian detectors rises above half.
        visible_release: clear again above this share.
        lost_s: not detected for so long while frames arrive is vanished (s): several frames in a row, as single misses
            are common.
        forget_s: a vanished track is given up (s); until then it is taken to be still there, unseen.
        confirm_s: a track counts once it is so old (s); ghosts live for a few frames.
        confidence_least: filtered confidence below which it is low; 0.5 is the operating point that detectors are
            usually shown and deployed at.
        confidence_release: high again above this.
        confidence_time_constant_s: of its filter (s).
        collapse_drop: fall of confidence that is a collapse.
        collapse_slowest_per_s: slower falls never count (1/s): k of the CUSUM on decrements. Found is a fall of
            drop + slowest * t within t: with the defaults 0.25 at once, 0.40 within 0.5 s.
        collapse_noise: the fall must also be so many robust standard deviations of the scatter from frame to frame; 8
            is, for white noise and the median of five, not seen in years.
        gate_m: a detection this near to the predicted place of a track may be the same thing (m): half the shoulder
            width of a median adult (0.46 m, ISO 7250-3).
        switch_s: a place is remembered so long for the next id (s).
        limb_classes: classes that are parts of a human.
        tool_classes: classes that are things.
        flips_least: frames of the wrong class within flips_window_s that are a misclassification. Independent flips of
            one frame in 400 give three within 25 frames once an hour at 50 Hz; a clear image gives far fewer.
        flips_window_s: see above (s).
        contrast_least: RMS contrast of the image; natural scenes have about 0.2 to 0.4 (Frazor and Geisler, 2006).
        sharpness_least: variance of the Laplacian relative to the reference image.
        luminance_least: darker than this there is nothing to see, whatever the contrast.
        saturated_most: share of saturated pixels (glare).
        image_unit: relative change of contrast or sharpness that is one standard deviation, unless it scatters more.
        image_tolerated: loss in these units that is never degradation: 2.5 * 0.1 is a quarter of the contrast, an
            optical depth of 0.29 by Koschmieder's law.
        false_alarm_s: least mean time between false alarms of the CUSUM on the image (s): a shift.
        frame_s: frame period that the run length is computed for (s).
        hold_s: how long a verdict stands after its reason has gone (s).
        max_age_s: age at which an input is stale (s).
        min_rate_hz: least rate of the detections (Hz).

    The false alarm rates of visual-occlusion and id-switching follow from no theory, for they are what the tracker
    makes of the scene. They are measured on runs without any reason for them (exact Poisson bounds, 95 %, two-sided):
    visual-occlusion was never present in 0.85 h of A6's nominal scenario (seeds 1 to 51), at most 4.3 per hour, and
    id-switching never in 0.65 h of A8's (seeds 1 to 39), at most 5.7 per hour. In 3.0 h of nominal and near-miss runs
    of A8, seeds from 30000, two interventions were false; class flips caused both. A8 does not report visual-occlusion.
    """

    kinds: tuple[str, ...] = KINDS
    camera: str = "camera"
    classes: tuple[str, ...] = ()
    occludable: tuple[str, ...] = ("human", "person")
    handover_classes: tuple[str, ...] = ("hand", "object")
    handover_zone: Box | None = None
    covering: tuple[str, ...] = ("hand",)
    cover_m: float = 0.15
    view: Box | None = None
    view_margin_m: float = 0.4
    visible_least: float = 0.65
    visible_release: float = 0.75
    lost_s: float = 0.3
    forget_s: float = 5.0
    confirm_s: float = 0.3
    confidence_least: float = 0.5
    confidence_release: float = 0.6
    confidence_time_constant_s: float = 0.2
    collapse_drop: float = 0.25
    collapse_slowest_per_s: float = 0.3
    collapse_noise: float = 8.0
    gate_m: float = 0.23
    switch_s: float = 0.5
    limb_classes: tuple[str, ...] = ("human", "person", "arm", "forearm", "hand", "limb")
    tool_classes: tuple[str, ...] = ("tool", "object")
    flips_least: int = 3
    flips_window_s: float = 0.5
    contrast_least: float = 0.08
    sharpness_least: float = 0.2
    luminance_least: float = 0.03
    saturated_most: float = 0.3
    image_unit: float = 0.1
    image_tolerated: float = 2.5
    false_alarm_s: float = 36_000.0
    frame_s: float = 0.02
    hold_s: float = 0.3
    max_age_s: float = 0.25
    min_rate_hz: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ConfigError: names the setting and its value.
        """
        if not self.kinds or len(set(self.kinds)) != len(self.kinds):
            raise ConfigError("vision.kinds", f"must be different kinds, at least one, not {list(self.kinds)}")
        for kind in self.kinds:
            if kind not in KINDS:
                raise ConfigError("vision.kinds", f"no such kind {kind!r}", nearest(kind, KINDS))
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if isinstance(value, str | tuple) or value is None:
                continue
            zero = name in ("min_rate_hz", "view_margin_m", "collapse_slowest_per_s")
            if not (math.isfinite(value) and (value > 0 or (zero and value == 0))):
                least = "not negative" if zero else "positive"
                raise ConfigError(f"vision.{name}", f"must be finite and {least}, not {value}")
        for low, high in (("visible_least", "visible_release"), ("confidence_least", "confidence_release")):
            if not getattr(self, low) <= getattr(self, high) <= 1.0:
                raise ConfigError(f"vision.{high}", f"{getattr(self, high)} is not between {low} and 1")
        if self.forget_s < self.lost_s:
            raise ConfigError("vision.forget_s", f"{self.forget_s} is below lost_s, {self.lost_s}")
        both = sorted(set(self.limb_classes) & set(self.tool_classes))
        if both:
            raise ConfigError("vision.tool_classes", f"{both[0]!r} is also among limb_classes")
        for name in ("handover_zone", "view"):
            box: Box | None = getattr(self, name)
            if box is not None and not all(a < b for a, b in zip(box[:3], box[3:], strict=True)):
                raise ConfigError(f"vision.{name}", f"{list(box)}: each lower bound must lie below its upper one")
