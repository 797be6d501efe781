"""Zenoh keys and liveliness tokens of ROS 2's rmw_zenoh, after its design document."""

from dataclasses import dataclass
from typing import Any

import xxhash

from touchline.schemas.cdr import service_type_hash, type_hash
from touchline.schemas.topics import Service, Topic

_TOKENS = "@ros2_lv"
_NO_ENCLAVE = "%"
NODE, PUBLISHER, SUBSCRIPTION, SERVER, CLIENT = "NN", "MP", "MS", "SS", "SC"

#: Quality of service ``reliability:durability:history,depth:deadline:lifespan:liveliness``; empty fields are defaults:
#: reliable, volatile, keep last, without limits of time.
VOLATILE_QOS = "::,10:,:,:,,"
LATCHED_QOS = ":1:,1:,:,:,,"


@dataclass(frozen=True)
class RosNode:
    """Node of the ROS 2 graph, with the keys of its topics and services.

    Attributes:
        domain: ROS domain id.
        namespace: Namespace with its leading slash; ``/`` for none.
        name: Name of the node.
        session: Zenoh id of its session.
        number: Its id in that session; its endpoints count on from there.
    """

    domain: int
    namespace: str
    name: str
    session: str
    number: int = 0

    def full_name(self, name: str) -> str:
        """Return a fully qualified name: in the node's namespace, unless it begins with a slash.

        ROS names have no hyphens.
        """
        return name if name.startswith("/") else f"{self.namespace.rstrip('/')}/{name.replace('-', '_')}"

    def token(self) -> str:
        """Return the node's liveliness token."""
        return f"{_TOKENS}/{self.domain}/{self.session}/{self.number}/{self.number}/{NODE}/{self._place()}"

    def twins(self) -> str:
        """Return an expression for the tokens of all nodes of this name in this domain."""
        return f"{_TOKENS}/{self.domain}/*/*/*/{NODE}/{self._place()}"

    def topic_key(self, topic: Topic) -> str:
        """Return the key of a topic's messages."""
        return self._data_key(topic.name, topic.type.ros_type, type_hash(topic.type))

    def service_key(self, service: Service[Any, Any]) -> str:
        """Return the key of a service."""
        return self._data_key(service.name, service.ros_type, service_type_hash(service.ros_type))

    def publisher_token(self, number: int, topic: Topic) -> str:
        """Return the token of this node's publisher of ``topic``; ``number`` is its endpoint's."""
        qos = LATCHED_QOS if topic.latched else VOLATILE_QOS
        return self._endpoint_token(number, PUBLISHER, topic.name, topic.type.ros_type, type_hash(topic.type), qos)

    def subscription_token(self, number: int, topic: Topic) -> str:
        """Return the token of this node's subscription to ``topic``; ``number`` is its endpoint's."""
        digest = type_hash(topic.type)
        return self._endpoint_token(number, SUBSCRIPTION, topic.name, topic.type.ros_type, digest, VOLATILE_QOS)

    def server_token(self, number: int, service: Service[Any, Any]) -> str:
        """Return the token of this node's server of ``service``."""
        return self._service_token(number, SERVER, service)

    def client_token(self, number: int, service: Service[Any, Any]) -> str:
        """Return the token of this node's client of ``service``."""
        return self._service_token(number, CLIENT, service)

    def servers(self, service: Service[Any, Any]) -> str:
        """Return an expression for the tokens of all nodes' servers of ``service`` in this domain."""
        what = self._what(service.name, service.ros_type, service_type_hash(service.ros_type))
        return f"{_TOKENS}/{self.domain}/*/*/*/{SERVER}/*/*/*/{what}/*"

    def _place(self) -> str:
        return f"{_NO_ENCLAVE}/{_mangled(self.namespace)}/{self.name}"

    def _data_key(self, name: str, ros_type: str, digest: str) -> str:
        return f"{self.domain}{self.full_name(name)}/{dds_type(ros_type)}/{digest}"

    def _service_token(self, number: int, kind: str, service: Service[Any, Any]) -> str:
        digest = service_type_hash(service.ros_type)
        return self._endpoint_token(number, kind, service.name, service.ros_type, digest, VOLATILE_QOS)

    def _what(self, name: str, ros_type: str, digest: str) -> str:
        return f"{_mangled(self.full_name(name))}/{dds_type(ros_type)}/{digest}"

    def _endpoint_token(self, number: int, kind: str, name: str, ros_type: str, digest: str, qos: str) -> str:
        return (
            f"{_TOKENS}/{self.domain}/{self.session}/{self.number}/{self.number + number}/{kind}/{self._place()}"
            f"/{self._what(name, ros_type, digest)}/{qos}"
        )


def dds_type(ros_type: str) -> str:
    """Convert ``std_msgs/msg/String`` to ``std_msgs::msg::dds_::String_``."""
    package, kind, name = ros_type.split("/")
    return f"{package}::{kind}::dds_::{name}_"


def gid(token: str) -> bytes:
    """Return the 16-byte id of an endpoint: XXH3-128 of its liveliness token, low half first."""
    return xxhash.xxh3_128_intdigest(token.encode()).to_bytes(16, "little")


def _mangled(name: str) -> str:
    return name.replace("/", "%")
