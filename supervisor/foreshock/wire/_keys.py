"""Key expressions: our own scheme, and rmw_zenoh's for ROS 2 robots that need no bridge.

Own scheme: ``foreshock/<channel>`` for streams, ``foreshock/<robot>/@/<service>`` for what supervisor, guards and
operators exchange: a chunk that begins with ``@`` is met by no wildcard, so that nobody who may write
``<robot>/*/*`` reaches a service. rmw_zenoh's: ``<domain>/<topic>/<type>/<hash>``.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from foreshock.errors import ConfigError
from foreshock.wire._types import rihs01

__all__ = ["Keys", "Naming", "dds_name", "liveliness_token"]

Naming: TypeAlias = Literal["foreshock", "rmw_zenoh"]
ROOT = "foreshock"
QOS_KEEP_LAST_10_BEST_EFFORT = "2::,10:,:,:,,"
"""rmw_zenoh's QoS text: reliability 2 is best effort; what is empty is its default."""


def dds_name(ros: str) -> str:
    """Name of a ROS 2 type in key expressions: ``std_msgs/msg/String`` is ``std_msgs::msg::dds_::String_``."""
    package, kind, name = ros.split("/")
    return f"{package}::{kind}::dds_::{name}_"


class Keys(msgspec.Struct, frozen=True):
    """Key expressions of one robot.

    Attributes:
        robot: its name.
        naming: whose scheme its streams follow; services always follow ours.
        domain: ROS domain id, of rmw_zenoh's scheme.
    """

    robot: str
    naming: Naming = "foreshock"
    domain: int = 0

    def __post_init__(self) -> None:
        if not self.robot or any(c in self.robot for c in "/*$#?@"):
            raise ConfigError("robot", f"{self.robot!r} cannot be part of a key expression")

    def stream(self, channel: str, ros: str) -> str:
        """Of a channel ``<robot>/<subject>/<quantity>`` that carries this ROS 2 type."""
        if self.naming == "rmw_zenoh":
            return f"{self.domain}/{channel}/{dds_name(ros)}/{rihs01(ros)}"
        return f"{ROOT}/{channel}"

    def every_type(self, channel: str) -> str:
        """Of a channel whatever it carries: where the key names the type, one that carries another is to be seen."""
        return f"{self.domain}/{channel}/*/*" if self.naming == "rmw_zenoh" else f"{ROOT}/{channel}"

    def service(self, name: str) -> str:
        """Of what is exchanged beside the streams, e.g. ``lease``, ``intervention``, ``status``."""
        return f"{ROOT}/{self.robot}/@/{name}"

    def alive(self, role: str, name: str) -> str:
        """Liveliness token of a supervisor, guard, twin or operator."""
        return f"{ROOT}/{self.robot}/@/alive/{role}/{name}"


def liveliness_token(
    domain: int,
    zid: str,
    node_id: int,
    entity_id: int,
    kind: Literal["NN", "MP", "MS"],
    node: str,
    topic: str = "",
    ros: str = "",
    qos: str = QOS_KEEP_LAST_10_BEST_EFFORT,
    namespace: str = "",
) -> str:
    """rmw_zenoh's liveliness token of a node (NN), publisher (MP) or subscription (MS).

    Args:
        domain: ROS domain id.
        zid: Zenoh id of the session.
        node_id: number of the node within the session.
        entity_id: number of the entity within the session.
        kind: of the entity.
        node: name of the node.
        topic: absolute name of the topic, e.g. ``/talos/joints/state``; not for a node.
        ros: ROS 2 type of the topic.
        qos: text of its QoS.
        namespace: of the node; empty for ``/``.
    """
    head = f"@ros2_lv/{domain}/{zid}/{node_id}/{entity_id}/{kind}/%/{_mangled(namespace or '/')}/{node}"
    if kind == "NN":
        return head
    return f"{head}/{_mangled(topic)}/{dds_name(ros)}/{rihs01(ros)}/{qos}"


def _mangled(name: str) -> str:
    return name.replace("/", "%")
