"""How long the values of a sensor may stay the same to the last bit before it is taken for frozen.

A sensor with noise repeats itself once by chance, not for long. What must fit in is a driver that sends an old
measurement again until it has the next one.
"""

from __future__ import annotations

__all__ = ["BODY_S", "TRACKED_S"]

BODY_S = 0.1
"""Of the robot's own sensors (joints, IMU, force and torque, odometry): five periods of one that measures at 50 Hz."""
TRACKED_S = 0.3
"""Of perception (people, gaze, detections): three periods of a tracker at 10 Hz."""
