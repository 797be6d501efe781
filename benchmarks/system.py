"""The whole system over Zenoh with recording on: real-time factors, start-up, message losses."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

RUNS = 3


def main() -> None:
    """Paint the pitch with each follower, as fast as it goes."""
    print(f"{'follower':14} {'real-time factor':>28} {'first motion s':>24} {'lost':>5}")
    for follower in ("mpc", "pure-pursuit"):
        reports = [_run(follower, seed) for seed in range(1, RUNS + 1)]
        factors = sorted(report["traversal"]["real_time_factor"] for report in reports)
        starts = sorted(report["first_motion_s"] for report in reports)
        lost = sum(report["bus"]["lost"] for report in reports)
        print(f"{follower:14} {_spread(factors, 'x'):>28} {_spread(starts, ''):>24} {lost:>5}")


def _spread(values: list[float], unit: str) -> str:
    return f"{values[0]:.1f} / {values[len(values) // 2]:.1f} / {values[-1]:.1f}{unit}"


def _run(follower: str, seed: int) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / "session.mcap"
        command = [sys.executable, "-m", "touchline", "run", "soccer-11", "--json"]
        options = ["--follower", follower, "--seed", str(seed), "--record", str(recording)]
        done = subprocess.run([*command, *options], capture_output=True, text=True, check=True)
        report: dict[str, Any] = json.loads(done.stdout)
        return report
