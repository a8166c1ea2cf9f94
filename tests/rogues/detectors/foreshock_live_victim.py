"""A supervisor paced in real time that answers a guard's requests on its standard streams, until its detector hangs.

Speaks JSON lines: a request ``[nonce, guard_ns]`` in, a lease ``[epoch, nonce, guard_ns, ttl_ns]`` or ``null`` out. The
line ``"hang"`` makes the detector hang in native code at the next tick.
"""

from __future__ import annotations

import json
import queue
import sys
import threading

import foreshock_cells as cells
from foreshock_stage import fresh

from foreshock.clock import monotonic_ns
from foreshock.config import Config, DetectorEntry, PolicyEntry
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor
from foreshock.watchdog import Watchdog


def main(watchdog_s: float) -> None:
    entry = DetectorEntry("cell", isolation="in-process")
    config = Config((entry,), policies=(PolicyEntry("paper-gate"),))
    supervisor = Supervisor(config, registry=Registry(modules={"cell": cells}))
    asked: queue.Queue[str] = queue.Queue()
    threading.Thread(target=lambda: [asked.put(line) for line in sys.stdin], daemon=True).start()
    began, what = monotonic_ns(), cells.ABSENT
    with Watchdog(watchdog_s) as watchdog:
        while True:
            now = monotonic_ns() - began
            supervisor.step([fresh(now, value=what)], now)
            watchdog.feed()
            try:
                request = json.loads(asked.get(timeout=0.005))
            except queue.Empty:
                continue
            if request == "hang":
                what = cells.HANG
                continue
            lease = supervisor.lease(*request, now_ns=monotonic_ns() - began, ttl_s=1.0)
            answer = None if lease is None else [lease.epoch, lease.nonce, lease.guard_ns, lease.ttl_ns]
            print(json.dumps(answer), flush=True)  # the protocol


if __name__ == "__main__":
    main(float(sys.argv[1]))
