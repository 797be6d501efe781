"""Recorder of the payloads of emulated robots in this process, or of nothing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from touchline.schemas.topics import DEFAULT_NAMESPACE
from touchline.services.robot_sim.packing import Payload


class PayloadRecorder:
    """Writes payloads to an MCAP file; a context manager, at whose end the file is finished.

    Args:
        path: The file; None: record nothing.
        namespaces: Namespaces of the robots.

    Raises:
        RecordingError: The file cannot be written.
    """

    def __init__(self, path: Path | None, namespaces: Sequence[str] = (DEFAULT_NAMESPACE,)) -> None:
        from touchline.recordings.recorder import Recorder

        self._path = path
        self._recorder = Recorder(path.absolute(), namespaces) if path is not None else None
        self._sequences: dict[tuple[str, str], int] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._recorder is not None:
            self._finished = self._recorder.finish()

    def hear(self, namespace: str, payloads: Sequence[Payload]) -> None:
        """Record the payloads of a robot, by default the first one.

        Raises:
            RecordingError: The disk is full, or failed.
        """
        if self._recorder is None:
            return
        for topic, payload in payloads:
            key = namespace, topic.name
            sequence = self._sequences[key] = self._sequences.get(key, 0) + 1
            self._recorder.write(topic.name, payload, sequence, namespace=namespace)

    def as_figure(self) -> dict[str, Any]:
        """Return a report's figure of the recording; empty without one."""
        figures = self.figures()
        return {"recording": figures} if figures is not None else {}

    def figures(self) -> dict[str, Any] | None:
        """Return the recording's figures, once it is finished."""
        if self._recorder is None:
            return None
        done = self._finished
        return {
            "path": str(self._path),
            "complete": not done.problem,
            "messages": done.messages,
            "bytes": done.bytes,
            "lost": done.lost,
        }
