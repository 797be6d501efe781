"""Requests to a team's dispatcher over the bus, and its queue."""

from __future__ import annotations

from collections.abc import Callable

from touchline.bus import Bus
from touchline.coordination.coordination import Coordination
from touchline.coordination.dispatch.queue_messages import QueueTeller, follow_order
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.errors import SpecError


class DispatchDesk:
    """Server of requests; call `turn` in a loop.

    Args:
        bus: Bus of the team's namespace.
        coordination: The team's coordinator.
    """

    def __init__(self, bus: Bus, coordination: Coordination) -> None:
        self._coordination, self._teller = coordination, QueueTeller()
        self._requests, self._queue = bus.serve(topics.TEAM_REQUESTS), bus.publisher(topics.TEAM_QUEUE)

    def turn(self, keep: Callable[[], None], *, ended: bool) -> None:
        """Serve a waiting call; after the end of the run only the queue is told.

        Args:
            keep: Keeps the tasks in memory, before anybody is told that they are taken.
            ended: Whether the run has ended.
        """
        if (call := self._requests.poll()) is None:
            return
        text = "{}" if ended else call.request.task_json
        try:
            answer = follow_order(self._coordination.dispatcher, text)
            if text != call.request.task_json:
                raise SpecError("team", "task", "has ended", "begin another")
        except SpecError as error:
            call.reply(m.TeamTaskResponse(success=False, message=str(error)))
            return
        keep()
        call.reply(m.TeamTaskResponse(success=True, message=answer))

    def publish(self, *, ended: bool) -> None:
        """Publish the queue if it has changed; to be called after each update.

        Args:
            ended: Whether the run ends with this update.
        """
        if (news := self._teller.news(self._coordination.dispatcher, ended=ended)) is not None:
            self._queue.send(news)
