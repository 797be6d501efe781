"""Bridge that records 5,000 messages a second for a minute: losses, and growth of memory.

`python -m benchmarks recording_rate`; `speed` is times real time (586 messages a second of sim time), `seconds` how
long (wall clock).
"""

from __future__ import annotations

import sys
import time
from typing import Final

from benchmarks._processes import Figures, figures
from benchmarks._settings import Small
from benchmarks._system import Hand, SystemLost, running_system
from touchline.bus import Bus
from touchline.recordings.reader import RecordingReader
from touchline.schemas import topics

_SETTLED: Final = 1.0 / 6.0
"""Share of the time after which the bridge has all that it keeps: figures from then on are compared."""
SMALL: Final = Small(
    {"seconds": 2.0, "template": "tennis"},
    (
        "# messages a second for # s, # in the file",
        "lost: nothing",
        "memory of the bridge: # MB, # MB in the end",
    ),
)


def main(speed: float = 9.0, seconds: float = 60.0, template: str = "soccer-11") -> None:
    """Record, and print rate, losses, memory and what it cost."""
    with running_system(speed) as system, Bus.open(topics.OPERATOR, system.config) as bus:
        hand = Hand(system, bus)
        path = system.recordings / "rate.mcap"
        hand.record_job(path, template)
        pid = system.processes()[topics.BRIDGE]
        begun_s = time.monotonic()
        samples: list[Figures] = []
        while (elapsed_s := time.monotonic() - begun_s) < seconds:
            time.sleep(1.0)
            hand.drive(template)
            found = figures(pid)
            if found is None:
                raise SystemLost("the bridge is gone")
            if elapsed_s > _SETTLED * seconds:
                samples.append(found)
        took_s = time.monotonic() - begun_s
        problem = hand.finish_recording()
        messages = sum(1 for _ in RecordingReader(path).messages())
    first, last = samples[0], samples[-1]
    growth_mb = last.memory_mb - first.memory_mb
    print(f"{messages / took_s:,.0f} messages a second for {took_s:.0f} s, {messages:,} in the file")
    print(f"lost: {problem or 'nothing'}")
    print(f"memory of the bridge: {first.memory_mb:.1f} MB, {growth_mb:+.1f} MB in the end")
    if problem:
        sys.exit(1)
