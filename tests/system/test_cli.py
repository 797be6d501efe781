"""The command line: help, reports, and errors that tell what to do."""

import json
import re
import signal
import time
from pathlib import Path

import pytest

from tests.system.commands import figures, start_touchline, touchline
from touchline.schemas.catalogue import parse_template
from touchline.schemas.messages import Trajectory

SERVICES = ["planner", "robot-sim", "bridge", "tui"]
COMMANDS = [
    "demo",
    "up",
    "status",
    "down",
    *SERVICES,
    "plan",
    "run",
    "simulate",
    "sweep",
    "templates",
    "record",
    "replay",
    "picture",
]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command):
    done = touchline(command, "--help")
    assert done.returncode == 0
    assert command in done.stdout
    assert len(done.stdout.splitlines()) > 4


def test_templates_are_listed_and_printed():
    listed = touchline("templates")
    assert "soccer-11" in listed.stdout
    assert "study-square" in listed.stdout
    rows = {row["name"]: row for row in json.loads(touchline("templates", "--json").stdout)}
    assert rows["study-square"]["length_m"] == pytest.approx(4.0)
    printed = touchline("templates", "soccer-11")
    assert len(parse_template(printed.stdout).segments) == rows["soccer-11"]["segments"]


def test_plan_writes_what_it_is_asked_for(tmp_path):
    out, report, plot = tmp_path / "t.json", tmp_path / "r.json", tmp_path / "p.svg"
    done = touchline("plan", "soccer-11", "--out", str(out), "--report", str(report), "--plot", str(plot), "--json")
    printed = figures(done)
    assert json.loads(report.read_text()) == printed
    assert printed["continuity"]["position_gap_m"] < 1e-9
    trajectory = Trajectory.model_validate_json(out.read_text())
    assert len(trajectory.path.segments) > printed["segments"]["painted"]
    assert "<svg" in plot.read_text()


def test_plan_orders_on_request():
    free, given = (figures(touchline("plan", "soccer-11", "--order", o, "--json")) for o in ("optimised", "given"))
    assert free["time_s"]["total"] < given["time_s"]["total"]
    assert given["estimate"]["paint_l"] > 1.0
    refused = touchline("plan", "soccer-11", "--hard-drying")
    assert refused.returncode in (1, 2)
    assert "is wet" in refused.stderr


def test_plan_obeys_its_limits():
    printed = figures(touchline("plan", "soccer-11", "--kappa-max", "0.9", "--sigma-max", "1.0", "--json"))
    assert printed["max"]["curvature_1pm"] <= 0.9 + 1e-9
    assert printed["max"]["sharpness_1pm2"] <= 1.0 + 1e-9


SEGMENT = {"id": "a", "line": {"start": [0, 0], "end": [5, 0]}}
TWICE = {"id": "bad", "line": {"start": [0, 2], "end": [1, 2]}}


BAD = {
    "not JSON": ("{", "is not JSON"),
    "empty": ('{"name": "t", "segments": []}', "segments"),
    "NaN": ('{"name": "t", "segments": [{"id": "a", "line": {"start": [0, 0], "end": [NaN, 0]}}]}', "end[0] is nan"),
    "zero length": (
        '{"name": "t", "segments": [{"id": "a", "line": {"start": [0, 0], "end": [0, 0]}}]}',
        "at least 0.01 m apart",
    ),
    "unknown field": (json.dumps({"name": "t", "segments": [SEGMENT], "speed": 3}), "speed is not a known field"),
    "same id twice": (json.dumps({"name": "t", "segments": [SEGMENT, TWICE, TWICE]}), 'share the id "bad"'),
}


# Both commands read templates with the same function: of `run` one is enough.
@pytest.mark.parametrize(("command", "bad"), [*(("plan", bad) for bad in BAD), ("run", "NaN")])
def test_a_bad_template_is_told_in_one_line(command, bad, tmp_path):
    text, says = BAD[bad]
    path = tmp_path / "field.json"
    path.write_text(text)
    done = touchline(command, str(path))
    assert done.returncode in (1, 2)
    assert says in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("plan", "no-such"), "soccer-11"),
        (("plan", "study-square", "--kappa-max", "-1"), "--kappa-max"),
        (("plan", "study-square", "--plot", "x.bmp"), ".svg"),
        (("plan", "study-square", "--out", "/no/such/folder/x.json"), "cannot be written"),
        (("run", "study-square", "--speed", "fast"), "--speed"),
        (("run", "study-square", "--follower", "lqr"), "follower"),
        (("robot-sim", "--scenario", "/no/such.json"), "cannot be read"),
        (("replay", "/no/such.mcap"), "no/such.mcap"),
    ],
)
def test_bad_arguments_are_told_in_one_line(arguments, says):
    done = touchline(*arguments)
    assert done.returncode == 2
    assert says in done.stderr
    assert "Traceback" not in done.stderr


def _catches(pid: int, number: int) -> bool:
    """Whether a process has a handler for a signal; before that, no program can end in order."""
    (caught,) = re.findall(r"^SigCgt:\s*(\w+)", Path(f"/proc/{pid}/status").read_text(), re.MULTILINE)
    return bool(int(caught, 16) >> (number - 1) & 1)


@pytest.mark.parametrize(
    ("number", "after_s", "code"),
    [(signal.SIGINT, 0.0, 130), (signal.SIGTERM, 0.0, 143), (signal.SIGHUP, 0.1, 129), (signal.SIGTERM, 3.0, 143)],
)
def test_a_command_ends_in_order_at_a_signal(number, after_s, code, bus_config, tmp_path):
    log = tmp_path / "log"
    command = start_touchline("sweep", "tennis", "--seeds", "100000", config=bus_config, log=log)
    while not all(_catches(command.pid, each) for each in (signal.SIGTERM, signal.SIGHUP)):
        assert command.poll() is None, log.read_text()
        time.sleep(0.001)
    time.sleep(after_s)
    command.send_signal(number)
    assert command.wait(100) == code
    assert "interrupted" in log.read_text()
    assert "Traceback" not in log.read_text()


def test_commands_without_services_say_so(bus_config, tmp_path):
    done = touchline("record", str(tmp_path / "x.mcap"), config=bus_config)
    assert done.returncode == 2
    assert "nobody answers" in done.stderr
    status = touchline("status", "--json", config=bus_config)
    assert status.returncode == 1
    (robot,) = json.loads(status.stdout)["robots"]
    assert (robot["namespace"], robot["traversal"]) == ("tt2", None)
    assert {service["state"] for service in robot["services"]} == {"not running"}
    assert "nothing was running" in touchline("down", config=bus_config).stdout


def test_demo_without_a_terminal_paints_the_pitch(tmp_path: Path):
    done = touchline("demo", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "paint.coverage_pct" in done.stdout
    assert (tmp_path / "session.mcap").stat().st_size > 1_000_000
