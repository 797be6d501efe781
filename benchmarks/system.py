"""The whole system over Zenoh with recording on: real-time factors, start-up, message losses.

`python -m benchmarks system`; `runs` are made with each of `followers` (with commas).
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks._settings import Small

SMALL = Small(
    {"template": "study-square", "runs": 1, "followers": "mpc"},
    ("follower real-time factor first motion s lost", "mpc # / # / #x # / # / # 0"),
)


def main(template: str = "soccer-11", runs: int = 3, followers: str = "mpc,pure-pursuit") -> None:
    """Paint with each follower, as fast as it goes."""
    print(f"{'follower':14} {'real-time factor':>28} {'first motion s':>24} {'lost':>5}")
    for follower in followers.split(","):
        reports = [_run(template, follower, seed) for seed in range(1, runs + 1)]
        factors = sorted(report["traversal"]["real_time_factor"] for report in reports)
        starts = sorted(report["first_motion_s"] for report in reports)
        lost = sum(report["bus"]["lost"] for report in reports)
        print(f"{follower:14} {_spread(factors, 'x'):>28} {_spread(starts, ''):>24} {lost:>5}")


def _spread(values: list[float], unit: str) -> str:
    return f"{values[0]:.1f} / {values[len(values) // 2]:.1f} / {values[-1]:.1f}{unit}"


def _run(template: str, follower: str, seed: int) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / "session.mcap"
        command = [sys.executable, "-m", "touchline", "run", template, "--json"]
        options = ["--follower", follower, "--seed", str(seed), "--record", str(recording)]
        done = subprocess.run([*command, *options], capture_output=True, text=True, check=True)
        report: dict[str, Any] = json.loads(done.stdout)
        return report
