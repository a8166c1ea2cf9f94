"""The robot side of the motion lease: a dead supervisor is safe.

The guard sends a nonce and its own monotonic time; the supervisor echoes both in a Lease; motion is permitted until
guard time + time to live. A delayed lease therefore never renews, and a higher epoch fences off an older supervisor.
The control loop polls :meth:`MotionGuard.permitted`.
"""

from __future__ import annotations

from foreshock.records import Lease

__all__ = ["MotionGuard"]


class MotionGuard:
    """Holds the lease in the robot's process. No I/O and no clock of its own: both are handed in."""

    def __init__(self) -> None:
        self._epoch = -1
        self._nonce = 0
        self._asked: dict[int, int] = {}
        self._until_ns = -1

    def request(self, guard_ns: int) -> tuple[int, int]:
        """Nonce and guard time to send to the supervisor, on the robot's monotonic clock."""
        self._nonce += 1
        self._asked[self._nonce] = guard_ns
        if len(self._asked) > 64:
            del self._asked[min(self._asked)]
        return self._nonce, guard_ns

    def receive(self, lease: Lease) -> bool:
        """Take a lease; False if it is not an answer to this guard, altered, or from a fenced-off supervisor."""
        if lease.epoch < self._epoch or self._asked.get(lease.nonce) != lease.guard_ns or lease.ttl_ns <= 0:
            return False
        self._epoch = lease.epoch
        self._until_ns = max(self._until_ns, lease.guard_ns + lease.ttl_ns)
        self._asked = {n: t for n, t in self._asked.items() if n > lease.nonce}
        return True

    def permitted(self, guard_ns: int) -> bool:
        """Whether the robot may move now; when this turns False, it goes to its minimal risk condition by itself."""
        return guard_ns < self._until_ns
