"""Real-time factors in one process, cost of telemetry, and memory over hours of sim time.

`python -m benchmarks simulate`; each factor is the best of `repeats`, memory is followed for `hours`. The factors over
Zenoh are those of `python -m benchmarks system`.
"""

import os
import platform
import resource
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks._settings import Small
from touchline.jobs.single.simulation import Job, Products, simulate
from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import PlanOptions
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.telemetry import Telemetry
from touchline.services.robot_sim.warm_up import warm_up

FOLLOWERS = ("mpc", "pure-pursuit")
SIMULATED, LISTENED = (0.1, 0.3, 1.0), (0.1, 0.3)
"""Shares of the hours after which memory is printed: as `touchline simulate` runs, and with all telemetry."""
SMALL = Small(
    {"template": "study-square", "repeats": 1, "hours": 0.01},
    (
        "study-square: # min of driving; real-time factors, best of #",
        "follower in-process CPU only with hash",
        *(f"{follower} #x #x #x" for follower in FOLLOWERS),
        "repeating it sim time peak RSS RSS",
        "as simulate start #M #M",
        "with all telemetry start #M #M",
        "# h #M #M",
    ),
)


def main(template: str = "soccer-11", repeats: int = 3, hours: float = 10.0) -> None:
    """Run the whole benchmark."""
    print(f"{_processor()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}, {platform.python_version()}")
    warm_up(print)
    job = Job.prepare(load_template(template), PlanOptions())
    print(f"{template}: {job.plan_report.total_time_s / 60:.1f} min of driving; real-time factors, best of {repeats}")
    print(f"{'follower':14} {'in-process':>12} {'CPU only':>10} {'with hash':>10}")
    for follower in FOLLOWERS:
        config = OnboardConfig(follower=follower)
        wall, cpu = _factor(job, config, repeats, hashed=False)
        hashed, _ = _factor(job, config, repeats, hashed=True)
        print(f"{follower:14} {wall:>11.0f}x {cpu:>9.0f}x {hashed:>9.0f}x")
    print(f"\n{'repeating it':20} {'sim time':>10} {'peak RSS':>10} {'RSS':>10}")
    _memory(job, "as simulate", [hours * share for share in SIMULATED], listening=False)
    _memory(job, "with all telemetry", [hours * share for share in LISTENED], listening=True)


def _factor(job: Job, config: OnboardConfig, repeats: int, *, hashed: bool) -> tuple[float, float]:
    """Sim time per wall time and per CPU time, the better of several runs: others use this machine too."""
    walls, cpus = [], []
    for _ in range(repeats):
        cpu = time.process_time()
        outcome = simulate(job, Scenario(), config, Products(hashed))
        cpus.append(outcome.report.total_time_s / (time.process_time() - cpu))
        walls.append(outcome.report.total_time_s / outcome.wall_time_s)
    return max(walls), max(cpus)


def _memory(job: Job, title: str, hours: Sequence[float], listening: bool) -> None:
    """One emulator that paints the same again and again, with a full tank and battery each time."""
    emulator = Emulator(job.vehicle, Scenario(), OnboardConfig(follower="pure-pursuit"))
    telemetry, runner = Telemetry(emulator), FastRunner(emulator)
    print(f"{title:20} {'start':>10} {_peak_mb():>9.1f}M {_rss_mb():>9.1f}M")
    for until in hours:
        while emulator.time_s < until * 3600.0:
            emulator.world.state.tank_l, emulator.world.state.battery_wh = (
                job.vehicle.tool.capacity_l,
                job.vehicle.body.battery_wh,
            )
            emulator.load(job.trajectory, job.template)
            telemetry.loaded(job.trajectory, job.template)
            emulator.start()
            while emulator.active:
                if listening:
                    emulator.tick()
                    telemetry.after_tick()
                else:
                    runner.run(1000)
        print(f"{'':20} {emulator.time_s / 3600.0:>8.2f} h {_peak_mb():>9.1f}M {_rss_mb():>9.1f}M")


def _rss_mb() -> float:
    """Memory that this process holds now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "")
