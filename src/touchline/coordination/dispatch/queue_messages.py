"""Orders to a dispatcher, and messages about its queue."""

from __future__ import annotations

import json
from typing import Annotated

from pydantic import Field

from touchline.coordination.dispatch.dispatcher import TaskDispatcher
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import String
from touchline.schemas.spec import Spec, parse
from touchline.schemas.task_requests import Request


class DispatchOrder(Spec):
    """Order to a dispatcher: requests to add, or a task to cancel; neither asks for the queue."""

    add: Annotated[tuple[Request, ...], Field(max_length=10_000)] = ()
    cancel: str | None = None


def follow_order(dispatcher: TaskDispatcher | None, text: str) -> str:
    """Carry out an order in JSON, and return the answer.

    Raises:
        SpecError: It is invalid, or there is no dispatcher.
    """
    order = parse(DispatchOrder, text, "request")
    if dispatcher is None:
        raise SpecError("team", "task", "is not to be dispatched, or has not begun", "begin a task of kind dispatch")
    if order.cancel is not None:
        return f"{order.cancel}: {dispatcher.cancel(order.cancel)}"
    if order.add:
        return f"added: {', '.join(dispatcher.add(order.add))}"
    return json.dumps(dispatcher.queue())


class QueueTeller:
    """Messages about a dispatcher's queue, one whenever it has changed."""

    def __init__(self) -> None:
        """Begin with nothing told."""
        self._told = ""

    def news(self, dispatcher: TaskDispatcher | None, *, ended: bool) -> String | None:
        """Return the message after an update; None if there is nothing new.

        Args:
            dispatcher: The dispatcher, if there is one.
            ended: Whether the run ends with this update.
        """
        if dispatcher is None:
            return None
        if ended:
            dispatcher.close("the run has ended")
        text = json.dumps(dispatcher.queue())
        if text == self._told:
            return None
        self._told = text
        return String(data=text)
