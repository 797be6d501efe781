"""Replayed robot on the bus: sends the robot's messages, reports its paint, and refuses orders."""

from __future__ import annotations

from collections.abc import Mapping

from touchline.bus import Bus, HealthReporter
from touchline.recordings.replay.replay_cue import Cue
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.messages import ReplayStatus
from touchline.schemas.paint_history import PaintHistory
from touchline.schemas.replay_run import ReplayRun


class ReplayedRobot:
    """One robot of a replay.

    Args:
        bus: Bus of the node `replay`, in the robot's namespace.
        run: Identity of the replay's messages.
    """

    def __init__(self, bus: Bus, run: ReplayRun) -> None:
        self.bus = bus
        self._publishers = {
            topic.name: bus.publisher(topic, run.publisher_id) for topic in topics.TOPICS if _replayed(topic)
        }
        self._status = bus.publisher(topics.REPLAY_STATUS)
        self._health = HealthReporter(bus)
        self._presence = bus.presence()
        self._refused = [bus.serve(service) for service in topics.ROBOT_SERVICES]
        self._get_paint = bus.serve(topics.GET_PAINT)
        self._paint = PaintHistory()

    def robot_is_there(self) -> bool:
        """True if a robot is on the bus in this namespace, whose messages would mix with these."""
        self._presence.poll()
        return topics.ROBOT_SIM in self._presence.alive()

    def begin_anew(self, run: ReplayRun) -> None:
        """Start over after a jump: earlier messages no longer hold."""
        self._paint.clear()
        for publisher in self._publishers.values():
            self.bus.begin_anew(publisher, run.publisher_id)

    def send(self, cue: Cue) -> None:
        """Send a message of the recording."""
        self._note(cue)
        self._publishers[cue.topic.name].send_bytes(cue.payload)

    def recall(self, cue: Cue) -> None:
        """Send one of the messages in force after a jump; paint is kept until `recall_paint`."""
        if cue.topic is topics.PAINT:
            self._paint.add(cue.payload)
        else:
            self.send(cue)

    def recall_paint(self) -> None:
        """Send the paint that exists after a jump, each stroke whole."""
        for stroke in self._paint.strokes():
            self._publishers[topics.PAINT.name].send_bytes(encode(stroke))

    def _note(self, cue: Cue) -> None:
        if cue.topic is topics.PLAN:
            self._paint.clear()
        elif cue.topic is topics.PAINT:
            self._paint.add(cue.payload)

    def publish_status(self, status: ReplayStatus) -> None:
        """Publish the replay's status."""
        self._status.send(status)

    def serve(self, figures: Mapping[str, object], doing: str) -> None:
        """Answer requests, and publish this process's health."""
        self._health.poll(figures, message=doing)
        while (asked := self._get_paint.poll()) is not None:
            asked.reply_bytes(self._paint.answer())
        for server in self._refused:
            while (call := server.poll_unread()) is not None:
                response = server.service.response
                refusal = {"message": f"{self.bus.namespace} is a replay: there is no robot that could do it"}
                call.reply(response(success=False, **(refusal if "message" in response.model_fields else {})))


def _replayed(topic: topics.Topic) -> bool:
    """Return whether messages of a topic come from recordings, and not from the replay itself."""
    return topic not in (topics.REPLAY_STATUS, topics.DIAGNOSTICS)
