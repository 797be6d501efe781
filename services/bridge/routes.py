"""Routes of the gateway: one topic or service each, between the bus and ROS 2."""

import time
from dataclasses import dataclass
from typing import Any

from touchline.bus import Bus, Sample
from touchline.bus.calls import SILENT, Question
from touchline.bus.counters import Counters
from touchline.bus.ros2 import Ros2Request, Ros2Session
from touchline.schemas.cdr import MAX_PAYLOAD_BYTES, encode
from touchline.schemas.messages.base import Message
from touchline.schemas.topics import Service, Topic
from touchline.services.bridge.rmw_zenoh import RosNode, gid

#: Longest time for a service to answer; planning takes longest.
_ANSWER_TIMEOUT_S = 120.0
#: Time and period of looking for a service before a client learns that nobody answers: on a bus that has just come up,
#: processes learn of each other's services one after another.
_DISCOVERY_S = 0.5
_RETRY_S = 0.05
#: Most pending requests to one service; more wait their turn.
_UNDER_WAY = 16


@dataclass
class _UnderWay:
    """Request that the bus has not answered yet; ``question`` is empty between two attempts to find its service."""

    request: Ros2Request
    question: Question | None
    begun_s: float
    retry_s: float = 0.0


class TopicRoute:
    """Forwards one topic to ROS 2.

    Attributes:
        messages: Number of messages passed on.
    """

    def __init__(self, session: Ros2Session, node: RosNode, number: int, topic: Topic) -> None:
        """Declare publisher and token; ``number`` is the endpoint's number within the node."""
        token = node.publisher_token(number, topic)
        self._publisher = session.publisher(node.topic_key(topic), gid(token), latched=topic.latched)
        session.declare_token(token)
        self._sequence = 0
        self.messages = 0

    def send(self, sample: Sample) -> None:
        """Pass ``sample`` on; a message that is missing before it is missing in ROS 2's numbers, too."""
        self._sequence += sample.missed
        self.send_bytes(sample.payload, sample.source_time_ns)

    def send_bytes(self, payload: bytes, source_time_ns: int) -> None:
        """Pass on a payload without a sample; a time of 0 is now."""
        self._sequence += 1
        self._publisher.send(payload, self._sequence, source_time_ns or time.time_ns())
        self.messages += 1


class ServiceRoute:
    """Forwards requests to one service from ROS 2, and the answers back.

    A client of rmw_zenoh waits forever for a response when it is sent an error. So problems are reported in the
    response where that has ``success``; only other services answer with an error.

    Args:
        asking: Bus by which it asks.
        counters: Counters of the bridge's bus, for invalid requests.
        session: Session among ROS 2 nodes.
        node: ROS 2 node of the robot.
        number: Number of the endpoint within the node.
        service: The service.

    Attributes:
        urgent: Whether it stops the robot.
        calls: Requests so far.
        refused: Number of invalid requests, and of those without a response.
    """

    def __init__(
        self,
        asking: Bus,
        counters: Counters,
        session: Ros2Session,
        node: RosNode,
        number: int,
        service: Service[Any, Any],
    ) -> None:
        self._asking, self._counters = asking, counters
        self._service = service
        self.urgent = service.urgent
        self._server = session.serve(node.service_key(service))
        session.declare_token(node.server_token(number, service))
        self._under_way: list[_UnderWay] = []
        self.calls = 0
        self.refused = 0

    def turn(self) -> None:
        """Take waiting requests, and pass answers back."""
        while len(self._under_way) < _UNDER_WAY and (request := self._server.poll()) is not None:
            self.calls += 1
            if problem := problem_of(request):
                self._counters.reject(f"ROS 2, {self._service.name}: {problem}")
                self._refuse(request, problem)
            else:
                self._under_way.append(_UnderWay(request, self._ask(request), time.monotonic()))
        self._under_way = [pending for pending in self._under_way if not self._answered(pending)]

    def _ask(self, request: Ros2Request) -> Question:
        return self._asking.ask(self._service, request.payload, _ANSWER_TIMEOUT_S)

    def _answered(self, pending: _UnderWay) -> bool:
        now_s = time.monotonic()
        if pending.question is None:
            if now_s >= pending.retry_s:
                pending.question = self._ask(pending.request)
            return False
        answer = pending.question.poll()
        if answer is None:
            return False
        if answer.payload is not None:
            pending.request.reply(answer.payload)
        elif answer.refusal is None and now_s < pending.begun_s + _DISCOVERY_S:
            pending.question, pending.retry_s = None, now_s + _RETRY_S
            return False
        else:
            self._refuse(pending.request, answer.refusal or f"nobody answers; {SILENT}")
        return True

    def _refuse(self, request: Ros2Request, reason: str) -> None:
        self.refused += 1
        response = refusal_response(self._service, reason)
        if response is not None and request.client is not None:
            request.reply(encode(response))
        else:
            request.fail(reason)


def refusal_response(service: Service[Any, Any], reason: str) -> Message | None:
    """Return the response with a reason for refusal; None if the service has none."""
    fields = {"success": False, "message": reason}
    known = {name: value for name, value in fields.items() if name in service.response.model_fields}
    response: Message | None = service.response(**known) if "success" in known else None
    return response


def problem_of(request: Ros2Request) -> str:
    """Return why a request is not passed on; its contents are for the service to check."""
    if request.client is None:
        return "a request without rmw_zenoh's attachment"
    if len(request.payload) > MAX_PAYLOAD_BYTES:
        return f"a request of {len(request.payload):,} bytes; at most {MAX_PAYLOAD_BYTES:,} are read"
    return ""
