"""Runs of a sweep that go wrong, figures that must be the report's own, and how a sweep ends."""

import dataclasses
import itertools
import json
import os
import signal
import threading
from contextlib import suppress
from multiprocessing import resource_tracker, util
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from tests.command import app
from tests.sweep.combining import combined
from tests.sweep.worker_tasks import KillsTheFirst, divide, signal_itself
from touchline.cli.options import ExitCode
from touchline.jobs.single import simulation
from touchline.jobs.single.simulation import Job, simulate
from touchline.jobs.sweep import task as sweep_task
from touchline.jobs.sweep.task import SweepRun, Task, prepare, run_figures
from touchline.jobs.task_pool import here, in_processes
from touchline.schemas.catalogue import load_template
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import PlanOptions, Trajectory, TraversalReport, TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.services.robot_sim import emulator


@pytest.fixture(scope="module")
def job():
    return Job.prepare(load_template("study-square"), PlanOptions())


def test_a_run_that_the_robot_refuses_fails_alone(job):
    nothing = dataclasses.replace(job, trajectory=Trajectory())
    refused = [Task(0, 0, Scenario(seed=seed), OnboardConfig()) for seed in (3, 4)]
    first, second = here(sweep_task.perform, [nothing], refused)
    assert (first.seed, first.success, first.figures) == (3, False, {})
    assert "no segment" in first.reason
    assert (second.seed, second.success) == (4, False)


def test_a_robot_that_waits_for_an_operator_is_given_up_at_once(job):
    scenario = Scenario(noise="none", faults=({"kind": "operator-lost", "start_s": 12.0},))
    outcome = simulate(job, scenario)
    assert not outcome.report.success
    assert "operator has not been heard" in outcome.reason
    assert 0.0 < outcome.report.coverage_pct < 100.0
    assert outcome.report.header.stamp.sec - 12.0 <= 0.01 * simulation._SLICE_TICKS + 2.0


def test_a_robot_that_never_comes_to_rest_ends_the_simulation_all_the_same(job, monkeypatch):
    """As one may whose drive is somebody's plug-in."""
    monkeypatch.setattr(simulation, "_PATIENCE_TICKS", 3000)
    monkeypatch.setattr(emulator, "RESTING_MPS", -1.0)
    assert simulate(job, Scenario(noise="none")).report.success


def test_a_robot_whose_estimate_alone_moves_does_not_move_on():
    standing = SimpleNamespace(active=True, tick_count=0, aborted="")

    def status():
        return SimpleNamespace(
            arc_length_m=3.0 + 0.01 * (standing.tick_count // 10 % 3),
            total_length_m=0.0,
            pause=None,
            state=TraversalStatus.PAUSED,
            reason=standing.aborted or "somebody comes and goes",
        )

    def run_slice():
        standing.tick_count += 10
        assert standing.tick_count < 10 * simulation._PATIENCE_TICKS
        standing.onboard = SimpleNamespace(status=status())

    def abort(why):
        standing.active, standing.aborted = False, why

    standing.abort = abort
    simulation._drive(standing, run_slice, lambda done, doing: None, 10, lambda: None)
    assert standing.aborted == "aborted by the simulation after 180 s without progress: somebody comes and goes"
    assert standing.tick_count == pytest.approx(simulation._PATIENCE_TICKS, abs=20)


def test_a_runs_figures_are_those_of_its_report():
    numbers = itertools.count(1)
    given = {name: next(numbers) for name in run_figures(TraversalReport())}
    assert run_figures(TraversalReport(**given)) == given


def test_each_combination_begins_with_its_own_seed():
    wanted = combined("seed=5,50", scenario=Scenario(seed=9))
    _, tasks = prepare(wanted, 2)
    assert [(task.case, task.scenario.seed) for task in tasks] == [(0, 5), (0, 6), (1, 50), (1, 51)]


@pytest.fixture
def sweep(monkeypatch):
    """The command with one worker, each run of it done by `perform(seed)`."""

    def begin(perform, *options):
        def performed(_jobs, task):
            return dataclasses.replace(perform(task.scenario.seed), case=task.case, seed=task.scenario.seed)

        monkeypatch.setattr("touchline.services.robot_sim.warm_up.warm_up", lambda *_: None)
        monkeypatch.setattr("touchline.jobs.sweep.task.perform", performed)
        return CliRunner().invoke(app, ["sweep", "study-square", "--seeds", "4", "--workers", "1", *options])

    return begin


def done(seed):
    return SweepRun(0, seed, True, "", {"coverage_pct": 100.0 - seed, "lateral_error_p95_m": 0.001 * seed})


def test_a_failed_run_makes_the_sweep_fail_and_is_named(sweep):
    ended = sweep(lambda seed: done(seed) if seed != 3 else SweepRun(0, 3, False, "refused", {}), "--json")
    assert ended.exit_code == ExitCode.FAILED
    told = json.loads(ended.stdout[ended.stdout.index("{") :])
    assert told["complete"]
    assert told["combinations"][0]["failed_seeds"] == [3]
    assert told["combinations"][0]["figures"]["coverage_pct"]["worst"] == 96.0


def test_the_table_has_mean_p95_worst_and_its_seed_in_peoples_units(sweep):
    ended = sweep(done)
    assert ended.exit_code == ExitCode.OK
    rows = {line.split(",")[0].strip(): line.split() for line in ended.stdout.splitlines() if "," in line}
    assert rows["coverage of the length"][-4:] == ["97.50", "96.15", "96.00", "4"]  # of 99, 98, 97, 96
    assert rows["lateral error p95"][-4:] == ["2.50", "3.85", "4.00", "4"]
    assert "4 of 4 runs" in ended.stdout


def test_ctrl_c_in_the_only_process_gives_what_is_done(sweep):
    def interrupted(seed):
        if seed == 3:
            raise KeyboardInterrupt
        return done(seed)

    ended = sweep(interrupted, "--json")
    assert ended.exit_code == ExitCode.INTERRUPTED
    told = json.loads(ended.stdout[ended.stdout.index("{") :])
    assert not told["complete"]
    assert [run["seed"] for run in told["runs"]] == [1, 2]


def test_a_worker_leaves_ctrl_c_to_its_parent():
    """A terminal sends it to all of them; a worker that dies of it would have its task counted as lost."""
    signals = [signal.SIGINT, signal.SIGKILL, signal.SIGINT, signal.SIGINT]
    told = list(in_processes(signal_itself, None, signals, 1, lambda number, why: (number, why)))
    assert [each for each in told if each == signal.SIGINT] == [signal.SIGINT] * 3
    ((number, why),) = [each for each in told if each != signal.SIGINT]
    assert number == signal.SIGKILL
    assert "was killed (SIGKILL)" in why


def test_a_worker_that_dies_before_its_first_task_is_done_without(tmp_path):
    shared = KillsTheFirst(tmp_path / "begun")
    assert list(in_processes(divide, shared, [1.0, 2.0, 4.0], 2, lambda _number, why: why)) == [1.0, 0.5, 0.25]
    shared.mark.unlink()
    with pytest.raises(TouchlineError, match=r"no task can be done: .*SIGKILL"):
        list(in_processes(divide, shared, [1.0], 1, lambda _number, why: why))


def test_what_goes_wrong_in_a_worker_goes_wrong_here():
    with pytest.raises(ZeroDivisionError) as caught:
        list(in_processes(divide, 1.0, [2.0, 0.0], 1, lambda _number, why: why))
    assert "in divide" in caught.value.__notes__[0]


def test_ctrl_c_while_a_worker_is_started_is_told_by_nobody_else(job, monkeypatch, capfd):
    """The worker gets what it needs through a pipe; it would complain if that broke off."""
    started, blocked = [], set()
    resource_tracker._resource_tracker._stop()  # it is started with the first worker, and that unblocks signals

    def spawn(path, arguments, descriptors, begin=util.spawnv_passfds):
        pid = begin(path, arguments, descriptors)
        if "--multiprocessing-fork" in arguments:
            started.append(pid)
            blocked.update(signal.pthread_sigmask(signal.SIG_BLOCK, ()))
            os.kill(os.getpid(), signal.SIGINT)
        return pid

    monkeypatch.setattr(util, "spawnv_passfds", spawn)
    over = threading.Event()
    other = threading.Thread(target=over.wait)  # gets the signal, if that is blocked in this one
    other.start()
    with pytest.raises(KeyboardInterrupt):
        list(
            in_processes(
                sweep_task.perform, [job], [Task(0, 0, Scenario(), OnboardConfig())] * 2, 2, sweep_task.lost_run
            )
        )
    over.set()
    other.join()
    with suppress(ChildProcessError):  # its end has been noted already
        os.waitpid(started[0], 0)
    assert len(started) == 1 and signal.SIGINT in blocked
    assert capfd.readouterr() == ("", "")
