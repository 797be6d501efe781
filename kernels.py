"""Compiles the kernels of all that ships, on all cores: `make kernels`.

With a folder as argument, a library of them is put there: a wheel takes it from `build/kernels` (`make wheel`). That
takes a C compiler's linker, `$CC` or `cc`.
"""

import gc
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from touchline.core import kernel_code, kernel_store

_BEGUN_S = time.perf_counter()


class Job(NamedTuple):
    """Kernels that one process compiles; `then` are jobs that share many of theirs.

    The processes of those fork from its own, so that what the compiler has made for it need not be made again.
    """

    name: str
    compile_kernels: Callable[[], object]
    then: "tuple[Job, ...]" = ()


def robot(vehicle: str, *followers: str) -> None:
    """Compile what a shipped vehicle drives with."""
    from touchline.schemas.setup import Setup
    from touchline.schemas.vehicles.shipped import SHIPPED
    from touchline.services.robot_sim.warm_up import warm_up

    for follower in followers:
        warm_up(setup=Setup(vehicle=SHIPPED[vehicle].vehicle, onboard={"follower": follower}), in_team=True)


def seeing(vehicle: str, follower: str) -> None:
    """Compile what a shipped vehicle drives with if it has a lidar."""
    from touchline.schemas.setup import Setup
    from touchline.schemas.vehicles.lidar_spec import LidarSpec
    from touchline.schemas.vehicles.shipped import SHIPPED
    from touchline.services.robot_sim.warm_up import warm_up

    with_lidar = SHIPPED[vehicle].vehicle.model_copy(update={"sensors": (LidarSpec(name="front"),)})
    warm_up(setup=Setup(vehicle=with_lidar, onboard={"follower": follower}), in_team=True)


def planner(*vehicles: str) -> None:
    """Compile what plans for shipped vehicles are made with."""
    from touchline.core.compilations import run_steps
    from touchline.schemas.vehicles.shipped import SHIPPED
    from touchline.services.planner.warm_up_planner import planner_steps

    for vehicle in vehicles:
        run_steps(planner_steps(SHIPPED[vehicle].vehicle), lambda _line: None)


def team() -> None:
    """Compile what a team and its coordinator need."""
    import numpy as np

    from touchline.coordination.coverage import coverage_of
    from touchline.coordination.density import DiscDensity
    from touchline.coordination.free_area import FreeArea
    from touchline.coordination.lloyd import EVEN
    from touchline.jobs.team.team_run import TeamRun
    from touchline.schemas.team import TeamScenario
    from touchline.services.coordinator.warm_up_team import warm_up_team

    corner = FreeArea.of([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    for density in (EVEN, DiscDensity(((0.5, 0.5, 0.2, 1.0),))):
        coverage_of(corner, density, 0.2).goals(np.array([(0.5, 1.5)]))
    for avoid in ("cells", "plans", "barriers"):
        warm_up_team(TeamScenario(avoid=avoid), FreeArea.of([(0, 0), (8, 0), (8, 8), (0, 8)]))
        TeamRun(TeamScenario(robots=2, duration_s=1.0, avoid=avoid)).run()
    ways = {"task": {"kind": "swap"}, "algorithm": {"use": "grid-ways"}, "avoid": "plans"}
    TeamRun(TeamScenario.model_validate({"robots": 2, "duration_s": 1.0, **ways})).run()


def estimating() -> None:
    """Compile what an estimator runs with on a recording."""
    from touchline.checking.estimating.estimator_inputs import EstimatorInputs
    from touchline.checking.estimating.log_figures import estimate_log

    inputs = EstimatorInputs(Path(__file__).with_name("examples") / "sessions" / "square.mcap", None)
    estimate_log(inputs, inputs.setup)


def learners() -> None:
    """Compile what the environments of learners step robots with."""
    import numpy as np

    from touchline.gym.follow_task import FollowTask

    task = FollowTask("study-square", {"action": "residual", "ticks": 100}, 1)
    task.step(np.zeros((1, 2), np.float32))


JOBS = (
    Job(
        "turf-tank-two",
        partial(robot, "turf-tank-two", "mpc", "pure-pursuit"),
        (
            Job("clay-roller", partial(robot, "clay-roller", "pure-pursuit", "mpc")),
            Job("turtlebot2", partial(robot, "turtlebot2", "mpc", "pure-pursuit"), (Job("team", team),)),
            Job("learners", learners, (Job("estimator", estimating),)),
            Job("lidar", partial(seeing, "turf-tank-two", "mpc")),
        ),
    ),
    Job(
        "planner: rolling",
        partial(planner, "clay-roller"),
        (Job("planner: marking, poses", partial(planner, "turf-tank-two", "turtlebot3-waffle-pi")),),
    ),
)


def run_all(jobs: tuple[Job, ...]) -> bool:
    """Run jobs side by side, each in a process forked from this one; return whether all of them went well."""
    started = []
    for job in jobs:
        process = os.fork()
        if not process:
            os._exit(0 if _run(job) else 1)
        started.append(process)
    codes = [os.waitpid(process, 0)[1] for process in started]
    return not any(codes)


def _run(job: Job) -> bool:
    try:
        job.compile_kernels()
    except BaseException:  # noqa: BLE001, the process must end here and not in the code that forked it
        traceback.print_exc()
        return False
    print(f"kernels: {job.name}: done after {time.perf_counter() - _BEGUN_S:.0f} s", flush=True)
    return run_all(job.then)


def main(folder: str | None = None) -> None:
    """Run the jobs; exit code 1 if one fails."""
    gc.disable()  # hardly anything that compiling makes is garbage before the end: looking for it takes a sixteenth
    os.environ["NUMBA_DISABLE_INTEL_SVML"] = "1"  # code with Intel's vector functions would need their library
    with tempfile.TemporaryDirectory() as anew:
        if folder:
            os.environ["XDG_CACHE_HOME"] = anew
            kernel_code.FOR_LIBRARY = True
        if not run_all(JOBS):
            sys.exit(1)
        if folder:
            shutil.rmtree(folder, ignore_errors=True)
            Path(folder).mkdir(parents=True)
            link(sorted(kernel_store.cache_folder().glob("*.o")), Path(folder))


def link(files: Sequence[Path], folder: Path) -> None:
    """Link the code of the cache's files into a library in a folder, beside which is said what is in it."""
    results = {}
    for file in files:
        results[file.stem], code = kernel_store.read(file)
        file.write_bytes(code)
    names = folder / "files"
    names.write_text("\n".join(map(str, files)), encoding="utf-8")
    library = folder / kernel_store.LIBRARY
    subprocess.run([os.environ.get("CC", "cc"), "-shared", "-o", str(library), f"@{names}", "-lm"], check=True)
    names.unlink()
    digest = kernel_store.digest(library.read_bytes())
    contents = kernel_store.Contents(numba=kernel_store.numba_version(), digest=digest, results=results)
    (folder / kernel_store.CONTENTS).write_text(json.dumps(contents), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
