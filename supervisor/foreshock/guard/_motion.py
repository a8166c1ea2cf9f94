"""The robot side of the motion lease: a dead supervisor is safe.

The guard sends a nonce and its own monotonic time; the supervisor echoes both in a Lease; motion is permitted until
guard time + time to live. A delayed lease therefore never renews, and a higher epoch fences off an older supervisor.
Since the supervisor says how long to live, the guard bounds it: a lease for years would outlive its supervisor.
The control loop polls :meth:`MotionGuard.permitted`.
"""

from __future__ import annotations

from foreshock.errors import ConfigError
from foreshock.records import Lease

__all__ = ["MotionGuard"]


class MotionGuard:
    """Holds the lease in the robot's process. No I/O and no clock of its own: both are handed in.

    Args:
        max_ttl_ns: a lease that wants to live longer is refused. The robot moves for at most so long after its
            supervisor died, so it belongs to the robot's safety case; 1 s is also what a Supervisor grants at most.

    Raises:
        ConfigError: max_ttl_ns is not a positive int.
    """

    def __init__(self, max_ttl_ns: int = 1_000_000_000) -> None:
        if type(max_ttl_ns) is not int or max_ttl_ns <= 0:
            raise ConfigError("guard.max_ttl_ns", f"{max_ttl_ns!r} is not a positive int of nanoseconds")
        self._max_ttl_ns = max_ttl_ns
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
        """Take a lease; False if not an answer to this guard, altered, too long, or from a fenced-off supervisor."""
        if any(type(x) is not int for x in (lease.epoch, lease.nonce, lease.guard_ns, lease.ttl_ns)):
            return False  # a NaN would compare as neither older nor longer
        if lease.epoch < self._epoch or self._asked.get(lease.nonce) != lease.guard_ns:
            return False
        if not 0 < lease.ttl_ns <= self._max_ttl_ns:
            return False
        self._epoch = lease.epoch
        self._until_ns = max(self._until_ns, lease.guard_ns + lease.ttl_ns)
        self._asked = {n: t for n, t in self._asked.items() if n > lease.nonce}
        return True

    def fence(self, epoch: int) -> bool:
        """A supervisor of this epoch was heard: older ones are refused from now on; False if it is one of them."""
        if epoch < self._epoch:
            return False
        self._epoch = epoch
        return True

    @property
    def until_ns(self) -> int:
        """When the permission ends, on the guard's clock; -1 before the first lease."""
        return self._until_ns

    def permitted(self, guard_ns: int) -> bool:
        """Whether the robot may move now; when this turns False, it goes to its minimal risk condition by itself."""
        return guard_ns < self._until_ns
