"""What robots can do against accidents other than a fall: how long each action takes, what it may make worse."""

from __future__ import annotations

from foreshock.policy import ActionSpec

__all__ = ["MODE_ACTIONS"]

BALANCE = ("foot-micro-slip", "torso-angular-spike", "com-lateral-deviation", "swing-leg-drift")
"""A robot that freezes in these may topple: rule 6."""

MODE_ACTIONS: tuple[ActionSpec, ...] = (
    ActionSpec("slow-approach", "less speed towards people", ("approach-speed",), 0.2, source="ISO/TS 15066, 5.5.4"),
    ActionSpec(
        "hold",
        "hold still, drives on (monitored standstill)",
        ("motion",),
        0.3,
        may_worsen=BALANCE,
        resumes=True,
        stops=True,
        source="ISO 10218-1, safety-rated monitored stop; IEC 60204-1 category 2",
    ),
    ActionSpec(
        "protective-stop",
        "stop, then drives off",
        ("motion",),
        0.3,
        may_worsen=BALANCE,
        resumes=True,
        stops=True,
        source="ISO 10218-1, protective stop; IEC 60204-1 category 1",
    ),
    ActionSpec("retreat", "move away from people", ("motion",), 0.6, BALANCE, resumes=True, source="ISO 13482, 5.10"),
    ActionSpec("replan", "take another path", ("path",), 0.4, source="ISO 13482, 5.10"),
    ActionSpec("shorten-step", "shorter, lower steps", ("steps",), 0.2, source="ISO 13482, 5.9"),
    ActionSpec("withdraw-arm", "arm back to the body", ("arms",), 0.3, source="ISO/TS 15066, 5.5.4"),
    ActionSpec("soften-arms", "compliant arms, torque limited", ("arm-stiffness",), 0.05, source="ISO/TS 15066, 5.5.5"),
    ActionSpec("regrasp", "grip harder, up to the object's limit", ("grip",), 0.15, source="ISO 13482, 5.11"),
    ActionSpec("release", "open the gripper", ("grip",), 0.15, ("grip-micro-slip",), source="ISO/TS 15066, 5.5.5"),
    ActionSpec("lower-load", "put the load down", ("arms",), 0.8, source="ISO 13482, 5.11"),
    ActionSpec("reorient-tool", "tool tip away from people", ("wrist",), 0.4, source="ISO 10218-2, 5.11"),
    ActionSpec("tool-off", "energy of the tool off", ("tool",), 0.2, source="ISO 10218-2, 5.11"),
    ActionSpec("derate", "less torque and speed of the joints", ("joint-torque",), 0.1, source="ISO 13482, 5.12"),
    ActionSpec("brake-joints", "mechanical brakes of the arm", ("arm-brakes",), 0.1, source="IEC 60204-1, 9.3.4"),
)
"""Beyond those that the core knows. Durations are of robots of TALOS size; the plant decides how well they work."""
