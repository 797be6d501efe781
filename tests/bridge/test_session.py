"""A recording while it goes on: how much of it a kill can cost."""

from pathlib import Path

from tests.bridge.test_sequencer import Sent
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.messages import Imu
from touchline.services.bridge.reader import read_summary
from touchline.services.bridge.recorder import Recorder
from touchline.services.bridge.session import FLUSH_PERIOD_S, RecordingSession
from touchline.services.bus.last_sent import LastSent


class Waiting:
    """One message more each time that it is asked."""

    def __init__(self) -> None:
        self.said = 0
        self.namespace = "tt2"
        self.rejected: dict[str, int] = {}
        self.cut: set[str] = set()

    def drain(self, most: int) -> list[Sent]:
        self.said += 1
        return [Sent(topics.IMU, self.said, self.said, encode(Imu()))]

    def told(self, sent: LastSent) -> int:
        return 0


def test_what_was_heard_half_a_second_ago_is_on_the_disk(tmp_path: Path) -> None:
    path, inbox = tmp_path / "session.mcap", Waiting()
    session = RecordingSession(Recorder(path), [inbox])
    kept = []
    for tenth in range(13):
        session.pump(tenth / 10)
        kept.append(read_summary(path).messages)
    # The youngest message is held for a round: others may turn out to be older.
    assert FLUSH_PERIOD_S == 0.5
    assert kept == [0] * 5 + [5] * 5 + [10] * 3
