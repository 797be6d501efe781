"""The command line as a process: it ends in order at a signal, and the demo needs no terminal."""

import re
import signal
import time
from pathlib import Path

import pytest

from tests.system.commands import start_touchline, touchline_here
from touchline.cli import demo_command


def _catches(pid: int, number: int) -> bool:
    """Return whether a process has a handler for a signal; before that, no program can end in order."""
    (caught,) = re.findall(r"^SigCgt:\s*(\w+)", Path(f"/proc/{pid}/status").read_text(), re.MULTILINE)
    return bool(int(caught, 16) >> (number - 1) & 1)


def _children(pid: int) -> list[str]:
    return [child for task in Path(f"/proc/{pid}/task").glob("*/children") for child in task.read_text().split()]


def _loads(pid: int) -> bool:
    """Return whether a process takes signals; a command does while it is still being loaded."""
    return all(_catches(pid, each) for each in (signal.SIGTERM, signal.SIGHUP))


def _works(pid: int) -> bool:
    """Return whether a sweep has begun: its first worker comes with a helper of Python's own."""
    return len(_children(pid)) > 1


@pytest.mark.parametrize(
    ("number", "doing", "code"),
    [
        (signal.SIGINT, _loads, 130),
        (signal.SIGTERM, _loads, 143),
        (signal.SIGHUP, _loads, 129),
        (signal.SIGTERM, _works, 143),
    ],
    ids=["Ctrl-C", "ended", "hung up", "ended at work"],
)
def test_a_command_ends_in_order_at_a_signal(number, doing, code, bus_config, tmp_path):
    log = tmp_path / "log"
    command = start_touchline("sweep", "study-square", "--seeds", "100000", config=bus_config, log=log)
    while not doing(command.pid):
        assert command.poll() is None, log.read_text()
        time.sleep(0.001)
    command.send_signal(number)
    assert command.wait(100) == code
    assert "interrupted" in log.read_text()
    assert "Traceback" not in log.read_text()


@pytest.mark.parametrize(("success", "code"), [(True, 0), (False, 1)])
def test_demo_without_a_terminal_runs_a_job_as_fast_as_it_goes(monkeypatch, tmp_path, success, code):
    asked = []

    def run_job(template, **how):
        asked.append((template.name, how["speed"], str(how["record"]), how["setup"].vehicle.name))
        return {"success": success}

    monkeypatch.setattr(demo_command, "run_job", run_job)
    monkeypatch.chdir(tmp_path)
    done = touchline_here("demo", "tennis", "--json", "--vehicle", "turtlebot2")
    assert (done.returncode, done.stdout) == (code, '{\n  "success": ' + str(success).lower() + "\n}\n"), done.stderr
    assert asked == [("tennis", -1.0, "session.mcap", "turtlebot2")]
