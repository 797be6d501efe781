"""Source of messages for ``echo`` and ``hz``: a recording, or a robot on the bus."""

import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from touchline.cli.display import print_event
from touchline.cli.options import config_of
from touchline.schemas import topics
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Event
from touchline.supervision.shutdown import until_stopped

if TYPE_CHECKING:
    from touchline.recordings.recorded import Recorded

LiveOption = Annotated[
    str | None,
    typer.Option("--robot", metavar="NAME", help="Listen to this robot on the bus instead of reading a recording."),
]
SecondsOption = Annotated[
    float, typer.Option("--seconds", metavar="S", help="With --robot: duration, s (0: until Ctrl-C).", min=0.0)
]


@contextmanager
def message_source(given: Sequence[str], robot: str | None, seconds: float) -> Iterator["Iterator[Recorded]"]:
    """Yield the messages of a recording, the first argument, or of a robot; of the given topics, or of all.

    Raises:
        SpecError: No recording is given.
        RecordingError: The recording cannot be read, or has no such topic.
    """
    if robot is None:
        from touchline.recordings.topic_selection import RecordedTopics

        if not given:
            raise SpecError("command line", "RECORDING", "is missing", "give a recording, or --robot for a live one")
        recorded = RecordedTopics(Path(given[0]), given[1:])
        with closing(recorded.messages()) as messages:
            yield messages
        if recorded.summary.problem:
            print_event(Event.WARN, f"{given[0]}: {recorded.summary.problem}")
        return
    from touchline.bus import Bus
    from touchline.cli.live_messages import live_messages

    end_s = time.monotonic() + seconds if seconds else float("inf")
    with Bus.open(topics.OBSERVER, config_of(robot)) as bus, until_stopped() as stop:
        yield live_messages(bus, given, lambda: bool(stop) or time.monotonic() > end_s)
