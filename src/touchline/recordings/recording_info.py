"""Figures of a recording: its files, times, robots and topics, and its losses."""

from pathlib import Path
from typing import Any

from touchline.recordings.channels import robots_among
from touchline.recordings.reader import read_summary
from touchline.recordings.recorded import FileSummary, Loss, Summary, TopicSummary
from touchline.recordings.wall_times import BEGUN, ENDED, as_wall_time, noted_wall_time


def recording_info(path: Path) -> dict[str, Any]:
    """Read the whole recording and return its contents as a JSON object.

    Raises:
        RecordingError: It cannot be opened, or is none.
    """
    held = read_summary(path)
    return {
        "path": str(path),
        "complete": held.complete and not held.losses,
        "problem": held.problem,
        "bytes": held.size_bytes,
        "messages": held.messages,
        "duration_s": held.duration_s,
        **_times(held),
        "robots": list(robots_among(held.topics)),
        "files": [_file(each) for each in held.files],
        "topics": {name: _topic(topic) for name, topic in sorted(held.topics.items())},
        "metadata": held.metadata,
        "attachments": [
            {"name": each.name, "media_type": each.media_type, "bytes": each.size_bytes, "file": each.file.name}
            for each in held.attachments
        ],
    }


def _times(held: Summary) -> dict[str, Any]:
    """Return sim time (s) and wall time of the beginning and the end; None where they are not recorded."""
    topics = [topic for topic in held.topics.values() if topic.messages]
    first_ns = min((topic.first_ns for topic in topics), default=0)
    last_ns = max((topic.last_ns for topic in topics), default=0)
    begun, ended = as_wall_time(first_ns), as_wall_time(last_ns)
    if begun is not None:  # a recorder with wall-clock log times
        return {"sim_time_s": None, "wall_time": {"begun": begun, "ended": ended}}
    sim_time_s = {"from": first_ns / 1e9, "to": last_ns / 1e9} if topics else None
    noted = {"begun": noted_wall_time(held.metadata, BEGUN), "ended": noted_wall_time(held.metadata, ENDED)}
    return {"sim_time_s": sim_time_s, "wall_time": noted if any(noted.values()) else None}


def _file(file: FileSummary) -> dict[str, Any]:
    return {
        "name": file.path.name,
        "bytes": file.size_bytes,
        "messages": file.messages,
        "complete": file.complete,
        "losses": [_loss(loss) for loss in file.losses],
    }


def _loss(loss: Loss) -> dict[str, Any]:
    known = bool(loss.to_ns)
    return {
        "what": loss.what,
        "messages": loss.messages,
        "from_s": loss.from_ns / 1e9 if known else None,
        "to_s": loss.to_ns / 1e9 if known else None,
    }


def _topic(topic: TopicSummary) -> dict[str, Any]:
    span_s = (topic.last_ns - topic.first_ns) / 1e9
    return {
        "type": topic.ros_type,
        "encoding": topic.kind.encoding,
        "messages": topic.messages,
        "bytes": topic.bytes,
        "rate_hz": (topic.messages - 1) / span_s if span_s > 0 else None,
        "first_s": topic.first_ns / 1e9 if topic.messages else None,
        "last_s": topic.last_ns / 1e9 if topic.messages else None,
    }
