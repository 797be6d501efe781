"""A session written anew by the code of today, on purpose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from touchline.checking.rebuild import Rebuild
from touchline.checking.recorded_session import NotRebuilt, RecordedSession
from touchline.checking.replan import planned_again
from touchline.recordings.recorder import Existing, Recorder
from touchline.schemas.topics import RECORDED, Topic


def record_again(path: Path, session: RecordedSession, robot: str, told: Sequence[Topic] = RECORDED) -> None:
    """Do a session with today's plans, to the robot's rest, and put the recording of that in the place of a file.

    Args:
        path: Of the recording; what is there stays until the new one is complete.
        session: What is to be done.
        robot: Its namespace.
        told: Topics to be recorded.

    Raises:
        NotRebuilt: The robot does not obey an order any more.
        PlanningError: There is no plan any more.
        RecordingError: The file cannot be written.
    """
    jobs = [
        job._replace(trajectory=planned_again(job, session.setup.vehicle) or job.trajectory) for job in session.jobs
    ]
    rebuild = Rebuild(replace(session, jobs=jobs))
    new = path.with_name(f".{path.stem}.new{path.suffix}")
    recorder = Recorder(new, (robot,), told, Existing.REPLACE)
    wanted, counts = {topic.name for topic in told}, dict.fromkeys((topic.name for topic in told), 0)
    try:
        for payloads in rebuild.whole():
            for topic, payload in payloads:
                if topic.name in wanted:
                    counts[topic.name] += 1
                    recorder.write(topic.name, payload, counts[topic.name])
        if rebuild.refused:
            raise NotRebuilt("; ".join(rebuild.refused))
    except BaseException:
        recorder.finish()
        new.unlink(missing_ok=True)
        raise
    recorder.finish()
    new.replace(path)
