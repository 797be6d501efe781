"""End of a recording, even if the bridge hangs or has to be restarted, and the reasons why it is incomplete."""

import time
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Final

from touchline.bus import Bus, CallError
from touchline.schemas import topics
from touchline.schemas.messages import RecordStopRequest, RecordStopResponse

#: The bridge answers when it has recorded all that was sent: report after the first time, abort after the second.
REPORT_AFTER_S: Final = 1.5
PATIENCE_S: Final = 60.0
_RETRY_S: Final = 0.05


def end_recording(
    bus: Bus, report: Callable[[str], None], check: Callable[[], None] = lambda: None
) -> RecordStopResponse | None:
    """Have the bridge finish its recording; repeat the request if it or its answer got lost.

    Args:
        bus: Bus of a robot that the bridge records.
        report: Called with a message when the answer is late.
        check: Called often.

    Returns:
        The bridge's report; None after `PATIENCE_S`.
    """
    request, begun_s, reported = RecordStopRequest(request_id=uuid.uuid4().hex), time.monotonic(), False

    def wait() -> None:
        nonlocal reported
        check()
        if not reported and time.monotonic() > begun_s + REPORT_AFTER_S:
            reported = True
            report(f"the bridge does not answer yet; waiting up to {PATIENCE_S:.0f} s for it")

    while (left_s := begun_s + PATIENCE_S - time.monotonic()) > 0:
        try:
            return bus.call(topics.RECORD_STOP, request, left_s, wait)
        except CallError:  # cut off, or away; the same request is carried out once, however often it comes
            wait()
            time.sleep(_RETRY_S)
    return None


def lacking(report: RecordStopResponse | None, asked: Path) -> str:
    """Return why the recording to the path ``asked`` is incomplete; empty if it is complete."""
    if report is None:
        return f"the bridge has not answered for {PATIENCE_S:.0f} s"
    if not report.success:
        return report.message or "the bridge gives no reason"
    lacks = []
    if Path(report.path).name != asked.name:
        lacks.append(f"the bridge was restarted while it recorded; {Path(report.path).name} has what came after that")
    if report.lost:
        lacks.append(f"it lacks {report.lost:,} messages; its metadata say where")
    return "; ".join(lacks)
