"""The sequential tests of one gripper, tuned to one sampling period."""

from __future__ import annotations

import math

from foreshock_detectors._sequential import BandEnergy, Cusum, WindowedNis, band_gain, cusum_threshold
from foreshock_detectors.grip._config import GripConfig

__all__ = ["GATE", "Tests"]

GATE = 5.0
"""Innovations are cut at five standard deviations: one electrical spike adds 4.5 to CUSUM, a third of its limit."""


class Tests:
    """The sequential tests for one sampling period; built once it is known.

    Args:
        config: settings.
        dt: sampling period (s).
    """

    def __init__(self, config: GripConfig, dt: float) -> None:
        arl = config.false_alarm_s / dt
        reference = 0.5 * config.smallest_step_sigma
        band = (config.oscillation_low_hz, config.oscillation_high_hz, 1.0 / dt)
        window = config.oscillation_window_s
        self.dt = dt
        self.slip, self.rise = (Cusum(reference, cusum_threshold(arl, reference), GATE) for _ in range(2))
        self.load_scatter, self.grip_scatter = (WindowedNis(arl, least=config.oscillation_nis) for _ in range(2))
        self.load_band, self.grip_band, self.command_band = (BandEnergy(*band, window) for _ in range(3))
        self.decay = math.exp(-0.5 * dt / window)
        """Per sample, of a band RMS when the band falls silent."""
        # Sensor noise alone must stay well below the threshold: six times its band RMS where the sensor is that noisy.
        self.band_rms_n = max(config.oscillation_rms_n, 6.0 * config.noise_n * math.sqrt(band_gain(*band)))

    def restart(self) -> None:
        """A new grasp."""
        self.restart_load()
        self.grip_scatter.restart()
        self.grip_band.restart()
        self.command_band.restart()

    def restart_load(self) -> None:
        """Another load."""
        self.slip.restart()
        self.rise.restart()
        self.load_scatter.restart()
        self.load_band.restart()
