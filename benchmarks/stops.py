"""Random emergency stops under every load: time to the robot's confirmation, and proof that it has stopped.

`python -m benchmarks stops`; `runs` is the number of stops, `seed` that of the first, `loads`, `channels` and
`templates` restrict them to those named (with commas), `json_file` is for every stop's figures, `slack` multiplies the
bounds; `secured=true` for a secured system, `both=true` for an open and a secured one, stopped by turns: the times of
two runs one after another differ more than the systems do. Ends with exit code 1 if any stop was missed.
"""

from __future__ import annotations

import json
import math
import random
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Generator, Iterable, Sequence
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from benchmarks._mishaps import LOADS, NOTHING, SECURED_LOADS, Mishap, mishap
from benchmarks._observer import Observer
from benchmarks._processes import NODES
from benchmarks._recordings import verdict
from benchmarks._settings import Small
from benchmarks._stop_channels import CHANNELS, ByCall, ByConsole, ByOrder, StopChannel, stop_channels
from benchmarks._stranger_roles import IMPOSTOR
from benchmarks._system import RUNNING, STATES, Hand, System, SystemLost, running_system
from touchline.bus import Bus
from touchline.schemas import topics

LIMIT_S: Final = 0.3
"""Maximum time from the stop, or from the robot's being alive again, to its status."""
STARTING_S: Final = 2.0
"""Within which `touchline order`, its modules loaded, begins to ask; that comes before, and is not counted."""
SHOWN_MAX_S: Final = 1.5
"""Maximum time until a person sees that a stop is not acknowledged."""
ACKNOWLEDGED_S: Final = 5.0
"""Time to wait for the answer once the robot has stopped."""
PATIENCE_S: Final = 30.0
"""Time after which a stop, or a silent system, counts as failed."""
_SPEEDS: Final = (1.0, 20.0)
_COMPARED: Final = (0.5, 0.9, 0.99)
_RESAMPLES: Final = 2000
_SLOW_BITE: Final = {"slow-reader": 4.0, "stopped-reader": 4.0}
"""Time (s) that some loads need to take effect."""
SMALL: Final = Small(
    {"runs": 2, "seed": 22, "loads": NOTHING, "channels": "order,ros2", "templates": "tennis", "slack": 100.0},
    (
        "# emergency stops in # minutes: # within # s, 0 later and shown as not acknowledged until then, 0 missed",
        "0 with an open valve afterwards; milliseconds (p50 / p99 / max)",
        "load channel stops late missed answer status braking",
        "none order # 0 0 # / # / # # / # / # # / # / #",
        "none ros2 # 0 0 # / # / # # / # / # # / # / #",
    ),
)


@dataclass
class Stop:
    """One emergency stop; times are in seconds from its being given, or from the robot's being alive again if later.

    Attributes:
        answered_s: Time of the answer that reports success; `None` if there was none.
        estopped_s: Time of the robot's confirmation, as received by an independent observer.
        braked_s: Time of the first of the wheel commands that stay zero.
        unreachable_s: Time for which nothing could reach the robot after the stop.
        late: Whether it took longer than the limit, and its sender saw that it was not acknowledged.
        missed: Reason why it counts as missed; empty if it does not.
        valve: Whether paint could flow after it.
        secured: Whether the system is a secured one.
        notes: Other problems.
    """

    number: int
    channel: str
    load: str
    speed: float
    answered_s: float | None = None
    estopped_s: float | None = None
    braked_s: float | None = None
    unreachable_s: float = 0.0
    late: bool = False
    missed: str = ""
    valve: bool = False
    secured: bool = False
    notes: list[str] = field(default_factory=list)


def main(
    runs: int = 500,
    seed: int = 1,
    loads: str = ",".join(LOADS),
    channels: str = ",".join(CHANNELS),
    templates: str = "soccer-11,soccer-11,soccer-7",
    slack: float = 1.0,
    json_file: str = "",
    secured: bool = False,
    both: bool = False,
) -> None:
    """Stop the robot the given number of times, and print the figures."""
    named = _named("loads", loads, SECURED_LOADS if secured else LOADS)
    asked = _Stops(named, _named("channels", channels, CHANNELS), templates.split(","), slack, secured)
    begun = time.monotonic()
    numbers = range(seed, seed + runs)
    stops = list(stops_by_turns(numbers, asked) if both else random_stops(numbers, asked))
    wall_s = time.monotonic() - begun
    for side in (False, True) if both else (secured,):
        if both:
            print("secured" if side else "open")
        _print([stop for stop in stops if stop.secured == side], wall_s)
    if both:
        _print_ratios(stops)
    if json_file:
        Path(json_file).write_text(json.dumps([asdict(stop) for stop in stops], indent=1), encoding="utf-8")
    if any(stop.missed or stop.valve for stop in stops):
        sys.exit(1)


class _Stops(NamedTuple):
    """Channels, loads, templates, the factor on the bounds, and whether the system is a secured one."""

    loads: Sequence[str]
    channels: Sequence[str]
    templates: Sequence[str]
    slack: float
    secured: bool


def _named(setting: str, text: str, known: Sequence[str]) -> list[str]:
    names = text.split(",")
    if unknown := sorted(set(names) - set(known)):
        sys.exit(f"{setting}: no {', '.join(unknown)}; there are: {', '.join(known)}")
    return names


def random_stops(numbers: Iterable[int], asked: _Stops) -> Generator[Stop, None, None]:
    """Run stops by number, which is their seed; a lost system is replaced."""
    waiting = list(numbers)
    with tempfile.TemporaryDirectory(prefix="touchline-bench-") as keep:
        while waiting:
            ros2 = "ros2" in asked.channels
            with running_system(ros2=ros2, keep=Path(keep), secured=asked.secured) as system, ExitStack() as stack:
                try:
                    rig = _Rig(system, stack, asked)
                    while waiting:
                        stop = _drawn(waiting.pop(0), asked)
                        try:
                            rig.run(stop)
                        finally:
                            _tell(stop)
                            yield stop
                except SystemLost as lost:
                    sys.stderr.write(f"a new system: {lost}\n")


def stops_by_turns(numbers: Sequence[int], asked: _Stops) -> Generator[Stop, None, None]:
    """Run each stop on an open system and on a secured one, which stand side by side; each is the first by turns."""
    with ExitStack() as stack:
        runs = {
            secured: stack.enter_context(closing(random_stops(numbers, asked._replace(secured=secured))))
            for secured in (False, True)
        }
        for number in numbers:
            for secured in (False, True) if number % 2 else (True, False):
                yield next(runs[secured])


def ratios(
    before: Sequence[float], after: Sequence[float], quantiles: Sequence[float]
) -> list[tuple[float, float, float]]:
    """Return the ratio of each quantile of pairs of times, and the ends of its bootstrap interval of 95 %.

    Args:
        before: Times of the one system.
        after: Times of the other, in the same order of stops.
        quantiles: From 0 to 1.
    """
    pairs = np.array([before, after])
    drawn = np.random.default_rng(1).integers(pairs.shape[1], size=(_RESAMPLES, pairs.shape[1]))
    found = []
    for quantile in quantiles:
        lower, upper = np.quantile(pairs[:, drawn], quantile, axis=2)
        first, last = np.quantile(upper / lower, (0.025, 0.975))
        one, other = np.quantile(pairs, quantile, axis=1)
        found.append((float(other / one), float(first), float(last)))
    return found


def _drawn(number: int, asked: _Stops) -> Stop:
    chance = random.Random(number)
    # Each load in turn, so that none is left out of a short run.
    load = asked.loads[number % len(asked.loads)]
    return Stop(number, chance.choice(asked.channels), load, chance.choice(_SPEEDS), secured=asked.secured)


def _tell(stop: Stop) -> None:
    times = " ".join(
        "-" if value is None else f"{1e3 * value:.0f}" for value in (stop.answered_s, stop.estopped_s, stop.braked_s)
    )
    text = "; ".join([*([f"MISSED: {stop.missed}"] if stop.missed else []), *stop.notes])
    sys.stderr.write(
        f"{stop.number:4d} {stop.channel:8} {stop.load:22} {stop.speed:3g}x {times:>16} ms  {text[:300]}\n"
    )
    sys.stderr.flush()


class _Rig:
    """System with an operator, an observer, and the channels that stop it."""

    def __init__(self, system: System, stack: ExitStack, asked: _Stops) -> None:
        self._system, self._templates, self._slack = system, asked.templates, asked.slack
        self._bus = stack.enter_context(Bus.open(topics.OPERATOR, system.config, system.check))
        self._hand = Hand(system, self._bus)
        self._hand.ready()
        for template in dict.fromkeys(self._templates):
            self._hand.plan(template)
        self._apart = stack.enter_context(Bus.open("observer", system.config))
        self._observer = Observer(self._apart)
        self._rescue = ByCall(self._bus)
        self._channels = stack.enter_context(stop_channels(system, self._bus, frozenset(asked.channels)))

    def run(self, stop: Stop) -> None:
        """Drive, let the load take effect, stop, and evaluate the outcome."""
        chance = random.Random(-stop.number)
        channel = self._channels[stop.channel]
        self._observer = Observer(self._apart)  # a new one, which no earlier stranger has misled
        self._hand.listen_anew()
        if isinstance(channel, ByConsole) and not channel.wait_until_open():
            raise SystemLost("the console has ended")
        self._drive(stop, chance)
        before = self._system.processes()
        recording = self._system.recordings / f"{stop.number}.mcap"
        if problem := self._hand.record(recording):
            stop.notes.append(f"no recording: {problem}")
        try:
            with mishap(stop.load, self._system, chance, stop.speed) as done:
                self._let_bite(stop, done, chance)
                self._stop(stop, channel, done, chance)
        except (SystemLost, ProcessLookupError) as error:
            stop.missed = f"the system was lost: {error}"
            raise SystemLost(str(error)) from error
        finally:
            channel.rest()
        self._afterwards(stop, done, before)
        if problem:
            self._hand.finish_recording()  # one that began after its answer was due would refuse the next
        else:
            self._check_recording(stop, recording)

    def _drive(self, stop: Stop, chance: random.Random) -> None:
        if problem := self._hand.pace(stop.speed):
            stop.notes.append(f"speed: {problem}")
        self._hand.drive(chance.choice(self._templates))
        self._observer.watch(chance.uniform(0.1, 1.0))

    def _let_bite(self, stop: Stop, done: Mishap, chance: random.Random) -> None:
        """Wait until the load has an effect, and note its effect on a driving robot."""
        if stop.load == "flood-estop":
            self._observer.watch(0.5)
            self._hand.drive(self._templates[0])
        self._observer.watch(chance.uniform(0.3, 1.5) + _SLOW_BITE.get(stop.load, 0.0))
        self._system.check()
        if self._observer.state != RUNNING and not done.node:
            state = STATES.get(self._observer.state, "silent")
            stop.notes.append(f"disturbed: {state} ({self._observer.reason})")

    def _stop(self, stop: Stop, channel: StopChannel, done: Mishap, chance: random.Random) -> None:
        """Give the stop, and wait for its outcome."""
        observer = self._observer
        if isinstance(channel, ByConsole) and chance.random() < 0.7:
            channel.mash(chance)
        robot = observer.robot
        before_s = observer.estopped_s
        channel.send(chance)
        sent_s = channel.sent_s
        if done.frozen:
            done.thaw_s = sent_s + chance.uniform(0.1, 4.0)
        alive_s = None if self._in_path(stop, done) else sent_s
        deadline = sent_s + PATIENCE_S
        while time.monotonic() < deadline and not self._settled(stop, channel, sent_s):
            done.poll()
            channel.poll()
            observer.poll()
            if alive_s is None:
                alive_s = self._alive_again(done, robot)
            self._system.check()
        if isinstance(channel, ByOrder) and alive_s == sent_s:
            alive_s = channel.sent_s
            if alive_s - sent_s > STARTING_S * self._slack:
                stop.missed = f"took {alive_s - sent_s:.1f} s to begin"
        self._measure(stop, channel, sent_s, alive_s, already=before_s is not None)

    def _settled(self, stop: Stop, channel: StopChannel, sent_s: float) -> bool:
        """True if the robot has confirmed the stop, and its sender has the answer."""
        stopped_s = self._observer.estopped_s
        if stopped_s is None or self._observer.braked_s is None:
            return False
        patience_s = 2.0 * LIMIT_S if stop.channel == "console" else ACKNOWLEDGED_S
        return channel.acknowledged is not None or time.monotonic() - max(stopped_s, sent_s) > patience_s

    @staticmethod
    def _in_path(stop: Stop, done: Mishap) -> bool:
        """True if the frozen or ended service is on the route from this channel to the wheels."""
        return done.node == topics.ROBOT_SIM or (done.node == topics.BRIDGE and stop.channel == "ros2")

    def _alive_again(self, done: Mishap, robot: bytes) -> float | None:
        """Time since which the frozen or ended service is back, if it is."""
        if done.thawed_s is not None and not done.gone:
            return done.thawed_s
        if not done.gone:
            return None
        if done.node == topics.ROBOT_SIM:
            known = [self._observer.robot_since_s] if self._observer.robot != robot else []
            served = self._observer.serving_s
            return min([*known, *(at_s for pid, at_s in served.items() if pid != str(done.pid))], default=None)
        pid = self._system.processes().get(done.node)
        heard_s = self._observer.heard_s.get(done.node, 0.0)
        return heard_s if pid not in (None, done.pid) and time.monotonic() - heard_s < 0.1 else None

    def _measure(
        self, stop: Stop, channel: StopChannel, sent_s: float, alive_s: float | None, *, already: bool
    ) -> None:
        observer, answer = self._observer, channel.acknowledged
        base_s = sent_s if alive_s is None else max(sent_s, alive_s)
        if observer.estopped_s is not None and observer.estopped_s < base_s:
            base_s = sent_s  # it was reached before it was interrupted
        stop.unreachable_s = base_s - sent_s
        if already:
            stop.notes.append("stopped before")
        if observer.estopped_s is None:
            stop.missed = f"never, in {PATIENCE_S:.0f} s ({STATES.get(observer.state, 'silent')})"
        else:
            stop.estopped_s = max(0.0, observer.estopped_s - base_s)
            if stop.estopped_s > LIMIT_S * self._slack:
                until_s = min(observer.estopped_s, answer.at_s if answer else math.inf)
                if self._shown_unacknowledged(channel, base_s, until_s):
                    stop.late = True
                    stop.notes.append("late, and shown as not acknowledged meanwhile")
                else:
                    stop.missed = f"after {stop.estopped_s:.2f} s"
        if observer.braked_s is not None:
            stop.braked_s = max(0.0, observer.braked_s - base_s)
        elif not stop.missed:
            stop.missed = "wheels are still commanded"
        if answer is not None:
            stop.answered_s = max(0.0, answer.at_s - base_s)
            if observer.estopped_s is None or observer.estopped_s > answer.at_s + LIMIT_S * self._slack:
                stop.missed = f"answered {answer.text!r}, but nobody heard the robot stop"
            elif IMPOSTOR in answer.text:
                stop.missed = f"believed an impostor: {answer.text!r}"
        if stop.unreachable_s > SHOWN_MAX_S * self._slack and stop.channel == "console" and not channel.answers:
            stop.missed = stop.missed or f"not shown for {stop.unreachable_s:.1f} s as not acknowledged"

    @staticmethod
    def _shown_unacknowledged(channel: StopChannel, base_s: float, until_s: float) -> bool:
        """True if the sender of a late stop soon saw that it was not acknowledged, and nothing else until it was."""
        before = [answer for answer in channel.answers if answer.at_s < until_s]
        return any(each.at_s < base_s + SHOWN_MAX_S for each in before) and not any(each.done for each in before)

    def _afterwards(self, stop: Stop, done: Mishap, before: dict[str, int]) -> None:
        """Wait until the system has recovered, and stop the robot if the stop had failed."""
        self._observer.watch(0.2)
        if stop.estopped_s is None:
            self._rescue.send(random.Random(0))
            deadline = time.monotonic() + PATIENCE_S
            while self._observer.estopped_s is None and time.monotonic() < deadline:
                self._observer.poll()
                self._system.check()
            self._rescue.rest()
        self._hand.ready(PATIENCE_S)
        after = self._system.processes()
        died = [node for node in NODES if before.get(node) != after.get(node) and node != done.node]
        stop.notes += [f"{node} died" for node in died]
        self._observer.watch(0.1)
        if self._observer.estopped_s is None:
            stop.missed = stop.missed or f"it is {STATES.get(self._observer.state, 'silent')} again without a reset"

    def _check_recording(self, stop: Stop, recording: Path) -> None:
        """Add the problems in the recording."""
        if (problem := self._hand.finish_recording()) and not (stop.load.endswith(topics.BRIDGE)):
            stop.notes.append(f"recording: {problem}")
        for path in sorted(recording.parent.glob(f"{recording.stem}*.mcap")):
            found = verdict(path)
            stop.valve = stop.valve or found.flow
            stop.notes += [f"in the recording: {each}" for each in found.problems]
            path.unlink()


def _print(stops: list[Stop], wall_s: float) -> None:
    """A row for each load and channel, and one for each channel."""
    missed = sum(bool(stop.missed) for stop in stops)
    late = sum(stop.late and not stop.missed for stop in stops)
    print(f"{len(stops)} emergency stops in {wall_s / 60.0:.1f} minutes: {len(stops) - late - missed} within ", end="")
    print(f"{LIMIT_S} s, {late} later and shown as not acknowledged until then, {missed} missed, ", end="")
    print(f"{sum(stop.valve for stop in stops)} with an open valve afterwards; milliseconds (p50 / p99 / max)")
    print(f"{'load':22} {'channel':8} {'stops':>5} {'late':>5} {'missed':>6}", end=" ")
    print(f"{'answer':>21} {'status':>21} {'braking':>21}")
    groups: dict[tuple[str, str], list[Stop]] = defaultdict(list)
    for stop in stops:
        for name in ((stop.load, stop.channel), ("all", stop.channel), ("all", "all")):
            groups[name].append(stop)
    for (load, channel), group in sorted(groups.items(), key=lambda item: (item[0][0] == "all", item[0])):
        cells = [_spread([getattr(stop, f"{what}_s") for stop in group]) for what in ("answered", "estopped", "braked")]
        count, later = sum(bool(stop.missed) for stop in group), sum(stop.late for stop in group)
        print(
            f"{load:22} {channel:8} {len(group):5d} {later:5d} {count:6d} " + " ".join(f"{cell:>21}" for cell in cells)
        )
    for stop in stops:
        if stop.missed:
            print(f"  stop {stop.number}: {stop.load}, {stop.channel}, {stop.speed:g}x: {stop.missed}")
    for note, count in _counted(stops):
        print(f"  {count:4d}  {note}")


def _print_ratios(stops: list[Stop]) -> None:
    """Compare the times to the robot's answer and to its status where both systems have one."""
    print("pairs: open ms, secured ms, ratio and its bootstrap interval of 95 %")
    for name, what in (("answer", "answered"), ("status", "estopped")):
        times = {
            (stop.number, stop.secured): seconds
            for stop in stops
            if (seconds := getattr(stop, f"{what}_s")) is not None
        }
        numbers = [number for number, secured in times if not secured and (number, True) in times]
        if not numbers:
            continue
        before, after = ([times[number, secured] for number in numbers] for secured in (False, True))
        for quantile, (ratio, first, last) in zip(_COMPARED, ratios(before, after, _COMPARED), strict=True):
            one, other = (1e3 * float(np.quantile(side, quantile)) for side in (before, after))
            print(f"{name} {len(numbers):5d} p{100 * quantile:.0f}", end="")
            print(f" {one:7.0f} {other:7.0f} {ratio:6.2f} ({first:.2f} to {last:.2f})")


def _spread(values: list[float | None]) -> str:
    known = [1e3 * value for value in values if value is not None]
    if not known:
        return "-"
    median, p99 = np.quantile(known, (0.5, 0.99))
    return f"{median:.0f} / {p99:.0f} / {max(known):.0f}"


def _counted(stops: list[Stop]) -> list[tuple[str, int]]:
    counts: dict[str, int] = defaultdict(int)
    for stop in stops:
        for note in stop.notes:
            counts[f"{stop.load}: {note}"] += 1
    return sorted(counts.items(), key=lambda item: (-item[1], item[0]))
