"""Messages on the bus in the form of recorded ones, for the same readers."""

import time
from collections.abc import Callable, Iterator, Sequence

from touchline.bus import Bus
from touchline.recordings.channels import kind_of, topic_path
from touchline.recordings.recorded import Recorded
from touchline.schemas.errors import SpecError
from touchline.schemas.topics import TOPIC_BY_NAME, TOPICS

_WAIT_S = 0.05


def live_messages(bus: Bus, names: Sequence[str], stop: Callable[[], bool]) -> Iterator[Recorded]:
    """Yield the messages of a robot as they arrive, until ``stop``; their times are this machine's wall clock.

    Args:
        bus: The robot's.
        names: Topics, as in the topic table or in full; none: all.
        stop: Polled some twenty times a second.

    Raises:
        SpecError: There is no such topic.
    """
    prefix = f"/{bus.namespace}/"
    known = {name.removeprefix(prefix) for name in names}
    for name in known - TOPIC_BY_NAME.keys():
        raise SpecError("command line", "TOPIC", f"is {name!r}", "`touchline topics` lists all")
    asked = [TOPIC_BY_NAME[name] for name in sorted(known)] or list(TOPICS)
    kinds = {t.name: kind_of(t.type) for t in asked}
    inbox = bus.inbox(asked)
    while not stop():
        for sample in inbox.wait(_WAIT_S):
            now_ns, name = time.time_ns(), sample.topic.name
            path = topic_path(bus.namespace, sample.topic)
            yield Recorded(path, now_ns, now_ns, sample.sequence, sample.payload, kinds[name])
