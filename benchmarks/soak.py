"""Day of work, job after job, with refills and recordings: no growth, and no job that fails without a reason.

`python -m benchmarks soak`; `hours` is the emulated time, `speed` times real time, `seed` that of the choice of jobs,
`template` the one job instead. During each job operators join, ask for the robot's diagnostics and leave, one after the
other. The last three recordings are kept until the end, no more.
"""

from __future__ import annotations

import random
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import zenoh

from benchmarks._processes import NODES, Figures, figures
from benchmarks._recordings import verdict
from benchmarks._settings import Small
from benchmarks._system import Hand, System, SystemLost, new_id, running_system
from touchline.bus import Bus
from touchline.schemas import topics
from touchline.schemas.catalogue import line_templates
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import GetDiagnosticsRequest, TraversalStatus

_KEPT: Final = 3
_VISITORS: Final = 20
"""Operators who come and go during a job."""
_SAMPLE_S: Final = 10.0
_WARM_UP: Final = 0.2
"""Share of the samples that the trend leaves out."""
_STUCK_S: Final = 30.0
_REPORT_S: Final = 120.0
_TREND_MIN_H: Final = 2.0
"""From which on a trend is more than the first jobs' own needs."""
_GROWTH_MB_PER_H: Final = 2.0
_GROWTH_PER_H: Final = 0.5
"""Threads or descriptors."""
SMALL: Final = Small(
    {"hours": 0.01, "template": "study-square"},
    (
        "# emulated hours in # minutes",
        "process MB first last per hour threads per hour descriptors per hour",
        *(f"{name} # # # # → # # # → # #" for name in (*NODES, topics.SUPERVISOR)),
        "# jobs finished",
    ),
)


def main(hours: float = 24.0, speed: float = 20.0, seed: int = 1, template: str = "") -> None:
    """Work and print the trends."""
    templates = [template] if template else line_templates()
    with running_system(speed) as system, Bus.open(topics.OPERATOR, system.config) as bus:
        soak = _Soak(system, bus, random.Random(seed), speed)
        try:
            soak.run(templates, 3600.0 * hours)
        except SystemLost as lost:
            soak.note(f"BAD: aborted: {lost}")
        soak.print()
    if any(what.startswith("BAD") for what in soak.counts):
        sys.exit(1)


class _Soak:
    """System at work, with notes."""

    def __init__(self, system: System, bus: Bus, chance: random.Random, speed: float) -> None:
        self._system, self._chance, self._speed = system, chance, speed
        self._hand = Hand(system, bus)
        self._inbox = bus.inbox([topics.STATUS], keep="latest")
        self._clock = bus.inbox([topics.CLOCK], keep="latest")
        self._begun_s = self._sampled_s = self._told_s = time.monotonic()
        self._sim_s = self._before_s = 0.0
        self._recordings: list[Path] = []
        self.counts: Counter[str] = Counter()
        self._held: defaultdict[str, list[tuple[float, Figures]]] = defaultdict(list)

    def note(self, what: str) -> None:
        """Count a note; bad ones are printed at once."""
        self.counts[what] += 1
        if what.startswith("BAD"):
            sys.stderr.write(f"{self.hours:.2f} h: {what}\n")
            sys.stderr.flush()

    @property
    def hours(self) -> float:
        """Emulated hours of jobs so far."""
        return (self._before_s + self._sim_s) / 3600.0

    def run(self, templates: Sequence[str], sim_s: float) -> None:
        """Run jobs for a sim time."""
        self._hand.ready()
        pids = self._system.processes()
        self._sample()
        while self._before_s + self._sim_s < sim_s:
            self._job(self._chance.choice(templates))
        self._sample()
        after = self._system.processes()
        for name in NODES:
            if after.get(name) != pids[name]:
                self.note(f"BAD: {name} died")

    def _job(self, template: str) -> None:
        refusals = self._hand.replenish()
        for refusal in refusals:
            self.note(f"no refill: {refusal}")
        recording = self._system.recordings / f"soak-{sum(self.counts.values())}-{template}.mcap"
        problem = self._hand.record(recording)
        if problem:
            self.note(f"BAD: no recording: {problem}")
        self._hand.pace(self._speed)
        self._hand.drive(template)
        self._visit()
        self._follow(template)
        if not problem:
            self._check(recording)

    def _visit(self) -> None:
        """Operators join the bus, ask the robot for its diagnostics, and leave."""
        service = topics.diagnostics_service(topics.ROBOT_SIM)
        for _ in range(_VISITORS):
            try:
                with Bus.open(topics.OPERATOR, self._system.config) as bus:
                    bus.call(service, GetDiagnosticsRequest(request_id=new_id()))
            except (TouchlineError, zenoh.ZError) as error:
                self.note(f"BAD: a visitor was not answered: {error}")

    def _follow(self, template: str) -> None:
        """Wait until the job is done, with a person's help where the robot waits for one."""
        place, moved_s = -1.0, time.monotonic()
        while True:
            self._system.check()
            if time.monotonic() - self._sampled_s > _SAMPLE_S:
                self._sample()
            status = self._status()
            if status is not None:
                if status.arc_length_m != place:
                    place, moved_s = status.arc_length_m, time.monotonic()
                if status.state == TraversalStatus.DONE:
                    self.note("jobs finished")
                    return
                if status.state in (TraversalStatus.PAUSED, TraversalStatus.ESTOPPED):
                    self.note(
                        f"waits for a person: {status.reason}" if status.reason else "BAD: waits without a reason"
                    )
                    self._hand.drive(template)
                    moved_s = time.monotonic()
            if time.monotonic() - moved_s > _STUCK_S:
                raise SystemLost(f"no progress in {template} for {_STUCK_S:.0f} s")
            time.sleep(0.02)

    def _status(self) -> TraversalStatus | None:
        latest = None
        for _, message in self._inbox.messages():
            if isinstance(message, TraversalStatus):
                latest = message
        if latest is not None:
            now_s = latest.header.stamp.sec + latest.header.stamp.nanosec / 1e9
            if now_s < self._sim_s:  # the clock begins anew with a job
                self._before_s += self._sim_s
            self._sim_s = now_s
        return latest

    def _sample(self) -> None:
        self._sampled_s = now_s = time.monotonic()
        for name, pid in self._system.processes().items():
            if (held := figures(pid)) is not None:
                self._held[name].append((self.hours, held))
        if now_s - self._told_s > _REPORT_S:
            self._told_s = now_s
            sys.stderr.write(f"{self.hours:.2f} h, {self.counts['jobs finished']} jobs\n")
            sys.stderr.flush()

    def _check(self, recording: Path) -> None:
        if problem := self._hand.finish_recording():
            self.note(f"BAD: a recording is not whole: {problem}")
        found = verdict(recording)
        if not found.complete:
            self.note("BAD: a finished recording is not complete")
        for each in found.problems:
            self.note(f"BAD: in a recording: {each}")
        self._recordings.append(recording)
        while len(self._recordings) > _KEPT:
            self._recordings.pop(0).unlink(missing_ok=True)

    def print(self) -> None:
        """Print the work, and the trends of memory, threads and descriptors over emulated time."""
        wall_min = (time.monotonic() - self._begun_s) / 60.0
        print(f"{self.hours:.1f} emulated hours in {wall_min:.0f} minutes")
        head = f"{'MB first':>9} {'last':>7} {'per hour':>9} {'threads':>12} {'per hour':>9}"
        print(f"{'process':14} {head} {'descriptors':>12} {'per hour':>9}")
        for name, samples in sorted(self._held.items()):
            first, last = samples[0][1], samples[-1][1]
            trends = self._trends(samples)
            memory = f"{first.memory_mb:9.1f} {last.memory_mb:7.1f} {trends[0]:9.2f}"
            counts = (f"{f'{first[i]} → {last[i]}':>12} {trends[i]:9.2f}" for i in (1, 2))
            print(f"{name:14} {memory} {' '.join(counts)}")
            for what, trend, limit in zip(
                ("MB", "threads", "descriptors"), trends, (_GROWTH_MB_PER_H, _GROWTH_PER_H, _GROWTH_PER_H), strict=True
            ):
                if trend > limit and self.hours > _TREND_MIN_H:
                    self.counts[f"BAD: {name} grows by {trend:.2f} {what} an hour"] += 1
        for what, count in sorted(self.counts.items()):
            print(f"  {count:4d}  {what}")

    @staticmethod
    def _trends(samples: list[tuple[float, Figures]]) -> tuple[float, float, float]:
        """Slopes of the least-squares lines, per emulated hour, after the warm-up."""
        settled = samples[int(_WARM_UP * len(samples)) :]
        hours = np.array([hour for hour, _ in settled])
        if len(settled) < 3 or np.ptp(hours) == 0.0:
            return 0.0, 0.0, 0.0
        slopes = np.polyfit(hours, np.array([held for _, held in settled], dtype=float), 1)[0]
        return float(slopes[0]), float(slopes[1]), float(slopes[2])
