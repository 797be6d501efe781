"""Replacement of a recording by the present code's run, on request."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from touchline.checking.rebuild import Rebuild
from touchline.checking.recorded_session import NotRebuilt, RecordedSession
from touchline.checking.replan import planned_again
from touchline.recordings.recorder import Existing, Recorder
from touchline.schemas.topics import RECORDED, Topic


def record_again(path: Path, session: RecordedSession, robot: str, recorded: Sequence[Topic] = RECORDED) -> None:
    """Run a session with present plans, to the robot's rest, and replace a file by its recording.

    Args:
        path: Path of the recording; the old one stays until the new one is complete.
        session: The session to run.
        robot: Namespace of the robot.
        recorded: Topics to record.

    Raises:
        NotRebuilt: The robot no longer obeys an order.
        PlanningError: It can no longer be planned.
        RecordingError: The file cannot be written.
    """
    jobs = [
        job._replace(trajectory=planned_again(job, session.setup.vehicle) or job.trajectory) for job in session.jobs
    ]
    rebuild = Rebuild(replace(session, jobs=jobs))
    new = path.with_name(f".{path.stem}.new{path.suffix}")
    recorder = Recorder(new, (robot,), recorded, Existing.REPLACE)
    wanted, counts = {topic.name for topic in recorded}, dict.fromkeys((topic.name for topic in recorded), 0)
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
