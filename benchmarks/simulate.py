"""Real-time factors in-process and over Zenoh, what sensors and telemetry cost, and memory over hours of sim time."""

import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import PlanOptions
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.telemetry import Telemetry
from touchline.services.robot_sim.warm_up import warm_up
from touchline.services.runs.simulation import Job, Products, simulate

TEMPLATE = "soccer-11"
FOLLOWERS = ("mpc", "pure-pursuit")
REPEATS = 3
SIMULATED_HOURS = (1, 3, 10)
TOLD_HOURS = (1, 3)


def main() -> None:
    """All of it, on this machine."""
    print(f"{_processor()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}, {platform.python_version()}")
    warm_up(print)
    job = Job.prepare(load_template(TEMPLATE), PlanOptions())
    print(f"{TEMPLATE}: {job.plan_report.total_time_s / 60:.1f} min of driving; real-time factors, best of {REPEATS}")
    print(f"{'follower':14} {'in-process':>12} {'CPU only':>10} {'with hash':>10} {'Zenoh + recording':>18}")
    for follower in FOLLOWERS:
        config = OnboardConfig(follower=follower)
        wall, cpu = _factor(job, config, hashed=False)
        hashed, _ = _factor(job, config, hashed=True)
        print(f"{follower:14} {wall:>11.0f}x {cpu:>9.0f}x {hashed:>9.0f}x {_over_zenoh(follower):>17.0f}x")
    print(f"\n{'repeating it':20} {'sim time':>10} {'peak RSS':>10} {'RSS':>10}")
    _memory(job, "as simulate", SIMULATED_HOURS, listening=False)
    _memory(job, "with all telemetry", TOLD_HOURS, listening=True)


def _factor(job: Job, config: OnboardConfig, *, hashed: bool) -> tuple[float, float]:
    """Sim time per wall time and per CPU time, the better of several runs: others use this machine too."""
    walls, cpus = [], []
    for _ in range(REPEATS):
        cpu = time.process_time()
        outcome = simulate(job, Scenario(), config, Products(hashed))
        cpus.append(outcome.report.total_time_s / (time.process_time() - cpu))
        walls.append(outcome.report.total_time_s / outcome.wall_time_s)
    return max(walls), max(cpus)


def _over_zenoh(follower: str) -> float:
    with tempfile.TemporaryDirectory() as folder:
        options = ["--follower", follower, "--record", str(Path(folder) / "session.mcap"), "--json"]
        command = [sys.executable, "-m", "touchline", "run", TEMPLATE, *options]
        reports = [
            json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
            for _ in range(REPEATS)
        ]
    return max(float(report["traversal"]["real_time_factor"]) for report in reports)


def _memory(job: Job, title: str, hours: tuple[int, ...], listening: bool) -> None:
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
