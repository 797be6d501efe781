"""Recording of several robots in one file, by the bridge that serves them all."""

import uuid
from functools import partial
from pathlib import Path
from typing import Any, Final

from touchline.bus import Bus
from touchline.jobs.recording.recording_end import end_recording, lacking
from touchline.jobs.watcher import JobFailed, Watcher
from touchline.schemas import topics
from touchline.schemas.messages import Event, RecordRequest

_CALL_S: Final = 10.0


def begin_team_recording(bus: Bus, path: Path, watcher: Watcher) -> None:
    """Have the bridge record all of its robots from now on.

    Args:
        bus: Bus of one of them.
        path: The file.
        watcher: Checked meanwhile for whether the job can continue.

    Raises:
        JobFailed: The bridge refuses.
        CallError: It does not answer.
    """
    request = RecordRequest(request_id=uuid.uuid4().hex, path=str(path.absolute()))
    response = bus.call(topics.RECORD, request, _CALL_S, watcher.check)
    if not response.success:
        raise JobFailed(response.message)


def end_team_recording(bus: Bus, path: Path, watcher: Watcher) -> dict[str, Any]:
    """End the recording; return its figures, with the ``problem`` if it is not ``complete``."""
    watcher.stage("Finishing the recording")
    report = end_recording(bus, partial(watcher.event, Event.WARN), watcher.check)
    problem = lacking(report, path)
    figures: dict[str, Any] = {"path": str(path), "complete": not problem}
    if report is not None:
        figures |= {"messages": report.messages, "bytes": report.bytes, "lost": report.lost}
    return figures | ({"problem": problem} if problem else {})
