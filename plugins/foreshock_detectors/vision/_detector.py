"""The vision detector: tracks and image quality made into indications."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from foreshock.detector import Inputs
from foreshock.messages import Detections
from foreshock.records import Indication, Sample, SampleRef
from foreshock_detectors._sequential import Hysteresis, severity
from foreshock_detectors.vision._config import VisionConfig
from foreshock_detectors.vision._image import ImageQuality
from foreshock_detectors.vision._scene import Scene
from foreshock_detectors.vision._track import Track

__all__ = ["VisionDetector"]

WORST_FALL = 3.0
"""Falls are followed up to three times their limit."""


class VisionDetector:
    """Implements foreshock.detector.Detector.

    Kinds about a track have the track's id as subject, kinds about the whole view the camera's name; in an empty scene
    the camera is the subject of all, and all are absent. A track that has gone is reported absent for as long as it had
    been reported. While the last frame is malformed, nothing is said of tracks, and before the third image nothing of
    visual degradation; until its reference is learnt, by the end of the warm-up at 50 Hz, its limits judge alone.
    """

    def __init__(self, config: VisionConfig) -> None:
        self._config = config
        self._hold_ns = round(config.hold_s * 1e9)
        answers: Mapping[str, Callable[[SampleRef], Iterator[Indication]]] = {
            "visual-occlusion": lambda ref: self._occluded("visual-occlusion", self._config.occludable, ref),
            "handover-occlusion": lambda ref: self._occluded("handover-occlusion", self._config.handover_classes, ref),
            "low-vision-confidence": self._low,
            "confidence-collapse": self._collapsed,
            "id-switching": self._switched,
            "limb-tool-misclassification": self._misclassified,
        }
        self._answers = tuple(answers[kind] for kind in config.kinds if kind in answers)
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # nothing here is random
        """Forget everything."""
        config = self._config
        self._scene, self._image = Scene(config), ImageQuality(config)
        self._malformed = False
        self._frame: SampleRef | None = None
        self._picture: SampleRef | None = None
        low, high = 1.0 - config.confidence_least, 1.0 - config.confidence_release
        self._lowness = Hysteresis(low, high, self._hold_ns)
        self._collapse = Hysteresis(1.0, 0.5, self._hold_ns)
        self._least_confidence, self._fall, self._fall_limit = 1.0, 0.0, config.collapse_drop
        self._spoken: list[tuple[str, str]] = []
        self._since: dict[tuple[str, str], int] = {}
        self._gone: dict[tuple[str, str], int] = {}

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002  # time is the samples' own
        """One indication per kind and track, or per kind for those about the whole view."""
        for sample in inputs.new.get("detections", ()):
            self._take_frame(sample)
        for sample in inputs.new.get("statistics", ()):
            if self._picture is None or sample.stamp_ns > self._picture.stamp_ns:
                self._image.push(sample.value, sample.stamp_ns)  # type: ignore[arg-type]  # by the input's type
                self._picture = SampleRef(sample.channel, sample.stamp_ns)
        said: list[Indication] = []
        if self._frame is not None and not self._malformed:
            for answer in self._answers:
                said += answer(self._frame)
            self._depart(said, self._frame)
        if "statistics" in inputs.latest and self._picture is not None and self._image.judged:
            said.append(self._degraded(self._picture))
        return said

    def _take_frame(self, sample: Sample) -> None:
        value, stamp_ns = sample.value, sample.stamp_ns
        if self._frame is not None and stamp_ns <= self._frame.stamp_ns:
            return
        assert isinstance(value, Detections)  # noqa: S101  # by the input's type
        self._malformed = not all(0.0 <= d.confidence <= 1.0 and 0.0 <= d.visible <= 1.0 for d in value.detections)
        if self._malformed:
            return
        scene, config = self._scene, self._config
        scene.push(value, stamp_ns)
        self._frame = SampleRef(sample.channel, stamp_ns)
        self._least_confidence, self._fall, self._fall_limit = 1.0, 0.0, config.collapse_drop
        for track in scene.tracks:
            if not track.confirmed(config):
                continue
            confidence = track.confidence
            if confidence.level < self._least_confidence:
                self._least_confidence = confidence.level
            if confidence.fall * self._fall_limit > self._fall * confidence.limit:
                self._fall, self._fall_limit = confidence.fall, confidence.limit
            track.occlusion.push(1.0 - scene.visible(track), stamp_ns)
        self._lowness.push(1.0 - self._least_confidence, stamp_ns)
        self._collapse.push(self._fall / self._fall_limit, stamp_ns)

    def _depart(self, said: list[Indication], ref: SampleRef) -> None:
        """Report what is no longer spoken of as absent, for as long as it had been reported; note who is spoken of."""
        stamp, spoken, gone = ref.stamp_ns, [(i.kind, i.subject) for i in said], self._gone
        if spoken != self._spoken:
            now, before, since = set(spoken), set(self._spoken), self._since
            for key in sorted(before - now):
                gone[key] = 2 * stamp - since.pop(key)
            for key in sorted(now - before):
                since[key] = stamp
                gone.pop(key, None)
            self._spoken = spoken
        for (kind, subject), until_ns in tuple(gone.items()) if gone else ():
            if stamp > until_ns:
                del gone[kind, subject]
            else:
                said.append(Indication(kind, subject, stamp, False, 0.0, 1.0, "1", 0.0, (ref,), None, {"gone": 1.0}))

    def _each(self, tracks: list[Track]) -> Iterator[tuple[str, Track | None]]:
        """Tracks by distinct id; the camera where there is none."""
        yielded = {t.id: t for t in tracks}
        if not yielded:
            yield self._config.camera, None
        yield from yielded.items()

    def _occluded(self, kind: str, classes: tuple[str, ...], ref: SampleRef) -> Iterator[Indication]:
        config, scene, stamp = self._config, self._scene, ref.stamp_ns
        zone = config.handover_zone if kind == "handover-occlusion" else None
        limit = 1.0 - config.visible_least
        tracks = [t for t in scene.tracks if t.class_id in classes and t.inside(zone) and t.confirmed(config)]
        for subject, track in self._each(tracks):
            if track is None:
                yield Indication(kind, subject, stamp, False, 0.0, limit, "1", 0.0, (ref,))
                continue
            hidden, present = 1.0 - scene.visible(track), track.occlusion.present
            worst = severity(hidden, limit, 1.0) if present else 0.0
            measures = {"unseen_s": (stamp - track.seen_ns) * 1e-9, "covered": float(track.covered)}
            yield Indication(kind, subject, stamp, present, hidden, limit, "1", worst, (ref,), None, measures)

    def _low(self, ref: SampleRef) -> Iterator[Indication]:
        config, least, present = self._config, self._least_confidence, self._lowness.present
        limit = config.confidence_least
        worst = severity(-least, -limit, 0.0) if present else 0.0
        yield Indication(
            "low-vision-confidence", config.camera, ref.stamp_ns, present, least, limit, "1", worst, (ref,)
        )

    def _collapsed(self, ref: SampleRef) -> Iterator[Indication]:
        fall, limit, present = self._fall, self._fall_limit, self._collapse.present
        worst = severity(fall, limit, WORST_FALL * limit) if present else 0.0
        yield Indication(
            "confidence-collapse", self._config.camera, ref.stamp_ns, present, fall, limit, "1", worst, (ref,)
        )

    def _switched(self, ref: SampleRef) -> Iterator[Indication]:
        stamp = ref.stamp_ns
        tracks = [t for t in self._scene.tracks if t.confirmed(self._config)]
        for subject, track in self._each(tracks):
            n = track.switched.count(stamp) if track is not None else 0
            yield Indication("id-switching", subject, stamp, n > 0, float(n), 1.0, "1", severity(n, 0.0, 3.0), (ref,))

    def _misclassified(self, ref: SampleRef) -> Iterator[Indication]:
        config, stamp = self._config, ref.stamp_ns
        least = float(config.flips_least)
        tracks = [t for t in self._scene.tracks if t.confirmed(config)]
        for subject, track in self._each(tracks):
            n = float(track.flips.count(stamp)) if track is not None else 0.0
            present = n >= least
            worst = severity(n, least, config.flips_window_s / config.frame_s) if present else 0.0
            yield Indication("limb-tool-misclassification", subject, stamp, present, n, least, "1", worst, (ref,))

    def _degraded(self, ref: SampleRef) -> Indication:
        statistic, present = self._image.statistic, self._image.degraded.present
        worst = severity(statistic, 1.0, 2.0) if present else 0.0
        return Indication(
            "visual-degradation", self._config.camera, ref.stamp_ns, present, statistic, 1.0, "1", worst, (ref,)
        )
