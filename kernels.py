"""Compiles the kernels of all that ships, each job in a process, as many at once as there are cores: `make kernels`.

With a folder as argument, their code is put there: a wheel takes it from `build/kernels` (`make wheel`).
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROBOT = """
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.robot_sim.warm_up import warm_up
ships = SHIPPED[{0!r}]
for follower in {1!r}:
    warm_up(setup=Setup(vehicle=ships.vehicle, onboard={{"follower": follower}}), in_team=True)
"""
PLANNER = """
from touchline.core.compilations import run_steps
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.planner.warm_up_planner import planner_steps
for name in {0!r}:
    run_steps(planner_steps(SHIPPED[name].vehicle), lambda line: None)
"""
TEAM = """
import sys
from touchline.cli import main
sys.argv[1:] = ["fleet", "simulate", "--robots", "2", "--duration", "1"]
main()
"""
#: What takes longest begins first.
JOBS = {
    "planner: rolling": PLANNER.format(["clay-roller"]),
    "turf-tank-two": ROBOT.format("turf-tank-two", ["mpc", "pure-pursuit"]),
    "clay-roller": ROBOT.format("clay-roller", ["pure-pursuit", "mpc"]),
    "turtlebot2": ROBOT.format("turtlebot2", ["mpc", "pure-pursuit"]),
    "planner: marking, poses": PLANNER.format(["turf-tank-two", "turtlebot3-waffle-pi"]),
    "team": TEAM,
}


def main(folder: str | None = None) -> None:
    """Run the jobs; exit code 1 if one fails."""
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as anew, ThreadPoolExecutor(os.cpu_count()) as pool:
        # With Intel's functions for vectors, code would need their library.
        places = os.environ | {"NUMBA_DISABLE_INTEL_SVML": "1"} | ({"XDG_CACHE_HOME": anew} if folder else {})

        def done(name: str) -> bool:
            command = [sys.executable, "-c", JOBS[name]]
            run = subprocess.run(command, env=places, capture_output=True, text=True, check=False)
            print(
                f"kernels: {name}: {'failed' if run.returncode else 'done'} after {time.perf_counter() - begun:.0f} s"
            )
            sys.stderr.write(run.stderr if run.returncode else "")
            return not run.returncode

        if not all(list(pool.map(done, JOBS))):
            sys.exit(1)
        if folder:
            shutil.rmtree(folder, ignore_errors=True)
            Path(folder).mkdir(parents=True)
            for code in (Path(anew) / "touchline" / "kernels").glob("*.o"):
                shutil.copy(code, folder)


if __name__ == "__main__":
    main(*sys.argv[1:])
