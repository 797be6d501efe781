"""Records what emulated robots of this process tell, or takes it and records nothing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from touchline.schemas.topics import DEFAULT_NAMESPACE
from touchline.services.robot_sim.packing import Payload


class PayloadRecorder:
    """See the module; a context, at whose end the file is finished.

    Args:
        path: The file; None to record nothing.
        namespaces: Of the robots.

    Raises:
        RecordingError: It cannot be written.
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

    def hear(self, namespace: str, said: Sequence[Payload]) -> None:
        """Write down what a robot has said, the first one if it is not named.

        Raises:
            RecordingError: The disk is full, or failed.
        """
        if self._recorder is None:
            return
        for topic, payload in said:
            key = namespace, topic.name
            sequence = self._sequences[key] = self._sequences.get(key, 0) + 1
            self._recorder.write(topic.name, payload, sequence, namespace=namespace)

    def as_figure(self) -> dict[str, Any]:
        """As a figure of a report, if there is a recording."""
        figures = self.figures()
        return {"recording": figures} if figures is not None else {}

    def figures(self) -> dict[str, Any] | None:
        """What was recorded, once it is finished."""
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
