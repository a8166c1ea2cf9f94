"""A simulator that knows one page of Foreshock (docs/twins.md): a controller that throttles when it gets hot."""

import base64
import json
import struct
import sys
import time

import zenoh

STEP_NS = 10_000_000
HASH = "RIHS01_11012008e35919e7f1115137530f4b8e2ce6703e2386b9dd8e81eb0b7d04de40"
BEAT = {"name": "controller/heartbeat", "type": "foreshock_msgs/msg/Heartbeat", "hash": HASH, "period_ns": STEP_NS}
HELLO = {"protocol": 1, "robot": "robot", "period_ns": STEP_NS, "stepped": True, "clock": "simulated", "units": "SI",
         "frames": "REP-103", "channels": [BEAT], "actions": ["derate"]}  # fmt: skip


class Controller:
    def reset(self, watts=60.0):
        self.t, self.seq, self.kelvin, self.watts, self.load, self.events = 0, 0, 293.0, watts, 1.0, []

    def step(self):
        self.t, self.seq = self.t + STEP_NS, self.seq + 1
        self.kelvin += 0.01 * (self.load * self.watts - 0.5 * (self.kelvin - 293.0)) / 4.0
        if self.kelvin > 373.0 and not self.events:
            off = {"id": "shut-down", "mode": "A9", "value": self.kelvin, "limit": 373.0, "unit": "K"}
            self.events = [{**off, "stamp_ns": self.t}]
        throttled = self.kelvin > 353.0 and self.seq % 20 < 4
        sec, nanosec = divmod(self.t, 1_000_000_000)
        header = struct.pack("<iII4x", sec, nanosec, 1)  # stamp, and an empty frame_id, padded to 8 bytes
        data = b"\0\1\0\0" + header + struct.pack("<qd", self.seq, 0.06 if throttled else 0.004)
        return {"channel": "robot/controller/heartbeat", "type": BEAT["type"], "stamp_ns": self.t, "seq": self.seq,
                "data": base64.b64encode(data).decode(), "received_ns": self.t}  # fmt: skip

    def answer(self, ask):
        if ask["op"] == "hello":
            return HELLO
        if ask["op"] == "reset":
            self.reset(**ask.get("parameters", {}))
        for action in ask.get("interventions", []):
            self.load = 1.0 - 0.5 * action["strength"]
        samples = []
        while self.t < ask.get("until_ns", 0):
            samples.append(self.step())
        return {"samples": samples, "events": self.events, "probes": {"kelvin": self.kelvin}}


config, twin = zenoh.Config(), Controller()
config.insert_json5("listen/endpoints", json.dumps([sys.argv[1]]))
config.insert_json5("scouting/multicast/enabled", "false")
with zenoh.open(config) as session:
    key = "foreshock/robot/@/twin"
    reply = lambda q: q.reply(key, json.dumps(twin.answer(json.loads(bytes(q.payload)))))  # noqa: E731
    queries = session.declare_queryable(key, reply)
    time.sleep(float(sys.argv[2]) if len(sys.argv) > 2 else 1e9)
