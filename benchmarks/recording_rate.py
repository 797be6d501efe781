"""A bridge that records 5,000 messages a second for a minute: what is lost, and whether its memory grows.

`python -m benchmarks recording_rate`; TOUCHLINE_SPEED sets times real time (9, at 586 messages a second of sim time),
TOUCHLINE_SECONDS how long (60, wall clock).
"""

from __future__ import annotations

import os
import sys
import time
from typing import Final

from benchmarks._processes import Figures, figures
from benchmarks._system import Hand, SystemLost, running_system
from touchline.schemas import topics
from touchline.services.bridge.reader import RecordingReader
from touchline.services.bus import Bus

_TEMPLATE: Final = "soccer-11"
_SETTLED_S: Final = 10.0
"""After which the bridge has all that it keeps: figures from then on are compared."""


def main() -> None:
    """Record, and print rate, losses, memory and what it cost."""
    speed = float(os.environ.get("TOUCHLINE_SPEED", "9"))
    duration_s = float(os.environ.get("TOUCHLINE_SECONDS", "60"))
    with running_system(speed) as system, Bus.open(topics.OPERATOR, system.config) as bus:
        hand = Hand(system, bus)
        path = system.recordings / "rate.mcap"
        hand.record_job(path, _TEMPLATE)
        pid = system.processes()[topics.BRIDGE]
        begun_s = time.monotonic()
        samples: list[Figures] = []
        while (elapsed_s := time.monotonic() - begun_s) < duration_s:
            time.sleep(1.0)
            hand.drive(_TEMPLATE)
            found = figures(pid)
            if found is None:
                raise SystemLost("the bridge is gone")
            if elapsed_s > _SETTLED_S:
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
