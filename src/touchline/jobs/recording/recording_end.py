"""Ends a recording, though the bridge be frozen or have to be started again, and says what it lacks."""

import time
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Final

from touchline.bus import Bus, CallError
from touchline.schemas import topics
from touchline.schemas.messages import RecordStopRequest, RecordStopResponse

#: The bridge answers when it has recorded all that was sent. This is told when it takes long, and it is given up.
TELL_S: Final = 1.5
PATIENCE_S: Final = 60.0
_RETRY_S: Final = 0.05


def end_recording(
    bus: Bus, tell: Callable[[str], None], check: Callable[[], None] = lambda: None, patience_s: float = PATIENCE_S
) -> RecordStopResponse | None:
    """Have the bridge finish its recording, asking again where the request or its answer got lost.

    Args:
        bus: Of a robot that the bridge records.
        tell: Told when the answer is late.
        check: Called often.
        patience_s: How long the bridge is waited for.

    Returns:
        The bridge's report; None if there is none in time.
    """
    request, begun_s, told = RecordStopRequest(request_id=uuid.uuid4().hex), time.monotonic(), False

    def wait() -> None:
        nonlocal told
        check()
        if not told and time.monotonic() > begun_s + TELL_S:
            told = True
            tell(f"the bridge does not answer yet; waiting up to {patience_s:.0f} s for it")

    while (left_s := begun_s + patience_s - time.monotonic()) > 0:
        try:
            return bus.call(topics.RECORD_STOP, request, left_s, wait)
        except CallError:  # cut off, or away; the same request is carried out once, however often it comes
            wait()
            time.sleep(_RETRY_S)
    return None


def lacking(report: RecordStopResponse | None, asked: Path) -> str:
    """Why the recording that was ``asked`` for is not whole; empty if it is."""
    if report is None:
        return f"the bridge has not answered for {PATIENCE_S:.0f} s"
    if not report.success:
        return report.message or "the bridge does not say why"
    lacks = []
    if Path(report.path).name != asked.name:
        lacks.append(f"the bridge was ended while it recorded; {Path(report.path).name} has what came after that")
    if report.lost:
        lacks.append(f"it lacks {report.lost:,} messages; its metadata say where")
    return "; ".join(lacks)
