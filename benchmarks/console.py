"""Time from a key press to the bus: the operator's console in a separate terminal, idle and under key-mashing.

The console is `touchline tui` in a pseudo-terminal of 120 by 40. It has 1,000 entries in its log and a whole pitch of
paint on its map; the robot that it shows only talks, so nothing else takes the machine's time.
`python -m benchmarks console`; `stops` are pressed while it is idle, `mashed` after each kind of key-mashing for
`mash_s`.
"""

from __future__ import annotations

import queue
import sys
import threading
import time

import numpy as np

from benchmarks._console_robot import TalkingRobot, serve
from benchmarks._console_terminal import Terminal
from benchmarks._settings import Small
from touchline.bus import Bus, BusConfig
from touchline.bus.ports import free_port
from touchline.schemas import topics

LOG_ENTRIES = 1000
KEY_REPEAT_HZ = 30.0
MASHES = {"r held": "r", "space held": " ", "every key": "rs g+-f0[]\t"}
START_S = 60.0
LOST_S = 30.0
SMALL = Small(
    {"stops": 1, "mashed": 1, "mash_s": 0.2},
    ("median worst key to bus", *(f"{name} # ms # ms" for name in ("idle", *MASHES))),
)


def main(stops: int = 20, mashed: int = 8, mash_s: float = 6.0) -> None:
    """Press the emergency stop again and again, and print how long it took to reach the robot."""
    config = BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")
    heard: queue.Queue[tuple[str, float]] = queue.Queue()
    stop = threading.Event()
    with Bus.open(topics.ROBOT_SIM, config) as bus:
        robot = TalkingRobot(bus, LOG_ENTRIES)
        robot.stopped = lambda request_id, at_s: heard.put((request_id, at_s))
        thread = threading.Thread(target=serve, args=(robot, stop))
        thread.start()
        terminal = Terminal(config)
        try:
            if bus.wait_for({topics.CONSOLE}, START_S):
                sys.exit("the console did not come up")
            _wait_until_it_hears(terminal, heard)
            robot.publish_all()
            time.sleep(3.0)
            print(f"{'':12} {'median':>8} {'worst':>8}   key to bus")
            _print("idle", [_stop_s(terminal, heard) for _ in range(stops)])
            robot.repeats = True
            for name, keys in MASHES.items():
                _print(name, [_mashed_s(terminal, heard, keys, mash_s) for _ in range(mashed)])
        finally:
            terminal.leave()
            stop.set()
            thread.join()


def _wait_until_it_hears(terminal: Terminal, stops: queue.Queue[tuple[str, float]]) -> None:
    deadline_s = time.monotonic() + START_S
    while stops.empty():
        if time.monotonic() > deadline_s:
            sys.exit("the console does not react to keys")
        terminal.press("e")
        time.sleep(0.5)
    time.sleep(1.0)


def _print(name: str, took_s: list[float]) -> None:
    print(f"{name:12} {1e3 * np.median(took_s):>5.0f} ms {1e3 * max(took_s):>5.0f} ms", flush=True)


def _stop_s(terminal: Terminal, stops: queue.Queue[tuple[str, float]]) -> float:
    while not stops.empty():
        stops.get()
    begun_s = time.monotonic()
    terminal.press("e")
    _, at_s = stops.get(timeout=LOST_S)
    time.sleep(1.0)  # until the robot runs again
    return at_s - begun_s


def _mashed_s(terminal: Terminal, stops: queue.Queue[tuple[str, float]], keys: str, mash_s: float) -> float:
    for number in range(round(mash_s * KEY_REPEAT_HZ)):
        terminal.press(keys[number % len(keys)])
        time.sleep(1.0 / KEY_REPEAT_HZ)
    return _stop_s(terminal, stops)
