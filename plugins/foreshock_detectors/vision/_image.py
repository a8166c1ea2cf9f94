"""Quality of the camera image: what the optics and the light leave of it.

Contrast behind a layer of optical depth tau is C exp(-tau) (Koschmieder's law). Two ways to be degraded:
limits (contrast, sharpness, luminance and saturation beyond which nothing can be recognised; in the median of three
frames), and a loss relative to what this camera has shown lately: a CUSUM of

    z = (median - x) / max(unit * median, robust sigma),    G <- max(0, G + z - tolerated)

of contrast and of sharpness, so that losses below tolerated * unit of the median never add up. A lamp that is switched
changes the luminance and leaves both as they were. What the camera shows is learnt from LEARNT images; before, the
limits alone judge, and before the third image nothing does.
"""

from __future__ import annotations

from foreshock.messages import ImageStatistics
from foreshock_detectors._sequential import Cusum, Hysteresis, RunningMedian, cusum_threshold
from foreshock_detectors.vision._config import VisionConfig

__all__ = ["LEARNT", "ImageQuality"]

LEARNT = 31
"""Images until their median is known: 0.62 s at 50 Hz."""

SIGMA_PER_MAD = 1.4826
"""Standard deviation over median absolute deviation of a normal distribution: 1 / Phi^-1(3/4)."""

CLIP = 6.0
"""A loss is at most so many units: one black frame adds 3.5 to CUSUM at the default tolerance."""

GAIN = 0.002
"""Of the running medians: a memory of some 500 frames, so that dusk is followed and a fault is not."""

LEAST_MAD = 0.002
"""Of contrast and sharpness, in their unit."""

TINY = 1e-3
"""Least divisor: below it any image is black."""


class ImageQuality:
    """Judges the statistics of one camera image after another.

    Attributes:
        judged: whether there have been enough images to say anything.
        statistic: largest of limit over contrast and the like, and of CUSUM over its threshold; degraded at 1.
        degraded: the verdict, with hysteresis.
    """

    def __init__(self, config: VisionConfig) -> None:
        self._config = config
        threshold = max(
            2.0 * (CLIP - config.image_tolerated),  # two black frames in a row are not yet a degradation
            cusum_threshold(config.false_alarm_s / config.frame_s, config.image_tolerated),
        )
        self._tests = tuple(
            (RunningMedian(LEAST_MAD, GAIN, LEARNT), Cusum(config.image_tolerated, threshold, CLIP)) for _ in range(2)
        )
        self._recent: list[float] = []
        self.judged = False
        self.statistic = 0.0
        self.degraded = Hysteresis(1.0, 0.5, round(config.hold_s * 1e9))

    def push(self, image: ImageStatistics, stamp_ns: int) -> None:
        """Take the statistics of the next image."""
        config = self._config
        worst = 0.0
        for (median, cusum), x in zip(self._tests, (image.contrast, image.sharpness), strict=True):
            if median.ready:
                unit = config.image_unit * median.value
                sigma = SIGMA_PER_MAD * median.mad
                cusum.push((median.value - x) / (sigma if sigma > unit else unit))
                if cusum.value > 2.0 * cusum.threshold:
                    cusum.value = 2.0 * cusum.threshold
                share = cusum.value / cusum.threshold
                worst = share if share > worst else worst
            median.push(x)
        limit = max(
            config.contrast_least / max(image.contrast, TINY),
            config.sharpness_least / max(image.sharpness, TINY),
            config.luminance_least / max(image.luminance, TINY),
            image.saturated / config.saturated_most,
        )
        recent = self._recent
        recent.append(limit)
        if len(recent) < 3:
            return
        self.judged = True
        limit = sorted(recent)[1]
        recent.pop(0)
        worst = limit if limit > worst else worst
        self.statistic = worst
        self.degraded.push(worst, stamp_ns)
