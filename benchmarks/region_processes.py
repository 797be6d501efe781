"""Robots in regions, each region a process, over Zenoh routers in network namespaces.

`python -m benchmarks region_processes`: each region has a machine, a network namespace, with a router, the region, and
a process of the robots that begin there; the routers are linked to each other. Robots follow their plans exactly, at
`speed` times real time, each to one goal after another anywhere. `robots` is their number, `columns` and `rows` those
of regions, `seconds` the robots' time; with `namespaces=0` all routers are on loopback (else root is needed). Contacts
are counted every 0.1 s from what the robots drove (bodies touch at 0.354 m).
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.spatial import cKDTree

from benchmarks._processes import cpu_s
from benchmarks._region_process import PERIOD_S, TICK_S, Settings
from benchmarks._settings import NotHereError, Small
from touchline.bus import BusConfig
from touchline.bus.ports import free_port
from touchline.schemas.bus_variables import OPEN_VARIABLE

SMALL = Small(
    {"robots": 40, "seconds": 6.0, "namespaces": 0, "starting": 15.0},
    (
        "40 robots in 4 regions, # s at 0.5 × real time; processor time # s a second of theirs",
        "handovers # (#/s); # plans followed, # came too late; # % of the time without a new plan",
        "contacts 0; closest centres # m; mean speed # m/s",
    ),
)
BODIES_M: Final = 0.354
_PORT: Final = 7461


class Machines:
    """Machines of the regions: network namespaces on one switch, or all of them this one.

    Attributes:
        endpoints: Router of each.
    """

    def __init__(self, stack: ExitStack, folder: Path, count: int, *, namespaces: bool) -> None:
        self._stack, self._folder = stack, folder
        ports = [_PORT if namespaces else free_port() for _ in range(count)]
        self.endpoints = [f"tcp/127.0.0.1:{port}" for port in ports]
        self._holders = [self._hold() for _ in range(count + 1)] if namespaces else []
        reached = [f"tcp/10.9.2.{number}:{_PORT}" for number in range(1, count + 1)] if namespaces else self.endpoints
        if namespaces:
            self._connect(count)
        self.routers = [self._router(number, reached[:number]) for number in range(count)]

    def _hold(self) -> int:
        """Process that holds a namespace, which vanishes with it."""
        if os.geteuid() != 0 or not all(map(shutil.which, ("ip", "unshare", "nsenter"))):
            raise NotHereError("only root can make network namespaces, by ip, unshare and nsenter: give namespaces=0")
        command = ["unshare", "--net", "sh", "-c", "echo; exec sleep 3600"]
        holder = self._stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE))
        self._stack.callback(holder.kill)
        assert holder.stdout is not None
        holder.stdout.readline()
        return holder.pid

    def _connect(self, count: int) -> None:
        self._ip(count, "link add br0 type bridge", "link set br0 up")
        for number in range(count):
            self._ip(count, f"link add m{number} type veth peer name eth0 netns {self._holders[number]}")
            self._ip(count, f"link set m{number} master br0 up")
            self._ip(number, "link set lo up", f"addr add 10.9.2.{number + 1}/24 dev eth0", "link set eth0 up")

    def _ip(self, number: int, *lines: str) -> None:
        subprocess.run([*self._on(number), "ip", "-batch", "-"], input="\n".join(lines), text=True, check=True)

    def _on(self, number: int) -> list[str]:
        return ["nsenter", f"--net=/proc/{self._holders[number]}/ns/net", "--"] if self._holders else []

    def _router(self, number: int, others: list[str]) -> "subprocess.Popen[str]":
        """Start a router that is linked to all before it."""
        listens = f"tcp/0.0.0.0:{_PORT}" if self._holders else self.endpoints[number]
        file = self._folder / f"router-{number}.json5"
        file.write_text(json.dumps({"listen": {"endpoints": [listens]}, "connect": {"endpoints": others}}))
        config = BusConfig(self.endpoints[number], config_file=file)
        return self.start(number, ["touchline", "router"], {**config.environment(), OPEN_VARIABLE: "1"})

    def start(self, number: int, module: list[str], variables: Mapping[str, str]) -> "subprocess.Popen[str]":
        """Start a module's process on a machine."""
        process = self._stack.enter_context(
            subprocess.Popen(
                [*self._on(number), sys.executable, "-m", *module],
                env={**os.environ, **variables},
                stdout=subprocess.PIPE,
                stderr=None,
                text=True,
            )
        )
        self._stack.callback(process.kill)
        return process


def main(
    robots: int = 1000,
    columns: int = 2,
    rows: int = 2,
    seconds: float = 40.0,
    speed: float = 0.5,
    namespaces: int = 1,
    starting: float = 30.0,
) -> None:
    """Print the figures of a run; processes have `starting` seconds to start."""
    with ExitStack() as stack:
        folder, count = Path(stack.enter_context(tempfile.TemporaryDirectory())), columns * rows
        machines = Machines(stack, folder, count, namespaces=bool(namespaces))
        begun_s = time.monotonic() + starting
        settings = Settings(robots, columns, rows, seconds, speed, begun_s, machines.endpoints, str(folder))
        file = folder / "settings.json"
        file.write_text(json.dumps(settings._asdict()))
        started = {
            (kind, n): machines.start(
                n, ["benchmarks._region_process", kind, str(n), str(folder / "settings.json")], {}
            )
            for kind in ("region", "robots")
            for n in range(count)
        }
        time.sleep(max(begun_s - time.monotonic(), 0.0))
        before_s = [cpu_s(each.pid) for each in machines.routers]
        found = {each: json.loads(process.communicate()[0]) for each, process in started.items()}
        routed_s = sum(cpu_s(each.pid) for each in machines.routers) - sum(before_s)
        ticks = round(seconds / TICK_S)
        ways = [np.load(folder / f"places-{number}.npy")[:ticks] for number in range(count)]
        shortest = min(map(len, ways))
        places = np.concatenate([each[:shortest] for each in ways], axis=1)
    regions, hosts = ([found[kind, number] for number in range(count)] for kind in ("region", "robots"))
    _print_load(settings, regions, hosts, routed_s)
    _print_course(settings, regions, hosts, places)


def _print_load(
    settings: Settings, regions: list[dict[str, Any]], hosts: list[dict[str, Any]], routed_s: float
) -> None:
    shares = [sum(each["cpu_s"] for each in of) / settings.seconds for of in (regions, hosts)]
    shares.append(routed_s / settings.seconds)
    told = f"regions {shares[0]:.2f}, robots {shares[1]:.2f}, routers {shares[2]:.2f}"
    print(
        f"{settings.robots} robots in {len(regions)} regions, {settings.seconds:g} s at {settings.speed:g} × real "
        f"time; processor time {sum(shares):.2f} s a second of theirs ({told})"
    )
    planning_ms, late_s = (np.array([v for each in regions for v in each[key]]) for key in ("planning_s", "late_s"))
    due = len(regions) * settings.seconds / PERIOD_S
    print(
        f"planning of a region, ms an update: median {1e3 * np.median(planning_ms):.1f}, most "
        f"{1e3 * planning_ms.max():.1f}; done {np.median(late_s):.2f} s late (99 %: {np.quantile(late_s, 0.99):.2f}); "
        f"{100.0 * len(planning_ms) / due:.0f} % of the updates"
    )
    messages, sizes = Counter[str](), Counter[str]()
    for each in (*regions, *hosts):
        messages.update(each["messages"])
        sizes.update(each["bytes"])
    rates = ", ".join(f"{kind} {messages[kind] / settings.seconds:.0f}/s" for kind in ("letters", "orders", "reports"))
    print(f"{rates}; {sum(sizes.values()) / settings.seconds / 1e6:.2f} MB/s sent")


def _print_course(
    settings: Settings, regions: list[dict[str, Any]], hosts: list[dict[str, Any]], places: np.ndarray[Any, Any]
) -> None:
    handovers, owned = (sum(each[key] for each in regions) for key in ("handovers", "owned"))
    adopted, refused, unplanned = (sum(each[key] for each in hosts) for key in ("adopted", "refused", "unplanned"))
    gaps_s = np.array([gap_s for each in hosts for gap_s in each["gaps_s"]] or [0.0])
    share = unplanned / (places.shape[0] * places.shape[1])
    print(
        f"handovers {handovers} ({handovers / settings.seconds:.1f}/s); {adopted} plans followed, {refused} came too "
        f"late; {100.0 * share:.1f} % of the time without a new plan; {owned} robots owned at the end"
    )
    print(
        f"from the new owner to its first plan: median {np.median(gaps_s):.2f} s, 99 % "
        f"{np.quantile(gaps_s, 0.99):.2f} s, most {gaps_s.max():.2f} s"
    )
    touching, closest_m = set[tuple[int, int]](), np.inf
    contacts = 0
    for at in places:
        tree = cKDTree(at)
        closest_m = min(closest_m, float(np.asarray(tree.query(at, k=2)[0])[:, 1].min()))
        now = tree.query_pairs(BODIES_M)
        contacts += len(now - touching)
        touching = now
    mean_mps = float(np.hypot(*np.diff(places, axis=0).T).sum()) / settings.robots / settings.seconds
    print(f"contacts {contacts}; closest centres {closest_m:.4f} m; mean speed {mean_mps:.2f} m/s")
