"""The help says everything, in groups, and what is printed into a pipe is not wrapped."""

import io
import os
import re
import subprocess
import sys
from collections import Counter
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any
from unittest import mock
from xml.etree import ElementTree as ET

import pytest
from typer.main import get_command

from tests.command import app
from touchline.cli.commands import command_line
from touchline.cli.overview import PANELS, overview
from touchline.cli.ros2_choice import Ros2Choice

ROOT = Path(__file__).resolve().parents[2]
WHOLE: Any = get_command(app)
COMMANDS = sorted(WHOLE.commands)
JOBS = {"demo", "plan", "run", "simulate", "sweep", "templates"}
SYSTEM = {"up", "status", "down", "record", "replay", "picture", "planner", "robot-sim", "bridge", "tui"}


@pytest.mark.parametrize(("module", "names"), [each for panel in PANELS.values() for each in panel.items()])
def test_one_module_alone_is_loaded_for_its_commands(module: str, names: tuple[str, ...]) -> None:
    for name in names:
        assert set(get_command(command_line(name)).commands) == set(names), module  # type: ignore[attr-defined]


def shown(command: Any, *arguments: str, columns: str = "80") -> str:
    """Output of a command in a narrow terminal; building it anew each time would take the most time."""
    narrow = {"COLUMNS": columns, "TERMINAL_WIDTH": columns}
    with mock.patch.dict(os.environ, narrow), redirect_stdout(io.StringIO()) as output:
        command.main(arguments, prog_name="touchline", standalone_mode=False)
    return output.getvalue()


def test_every_command_is_in_a_group_and_told_to_the_end() -> None:
    text = shown(WHOLE, "-h")
    for group in ("Jobs", "Drawings and robots", "The running system", "Recordings", "Processes, each alone"):
        assert f"─ {group} ─" in text
    assert "…" not in text and "─ Commands ─" not in text
    assert all(f"│ {name} " in text for name in COMMANDS)
    assert set(COMMANDS) >= JOBS | SYSTEM


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_cuts_nothing_and_no_option_means_two_things(name: str) -> None:
    text = shown(WHOLE, name, "-h")
    # What is cut ends a cell of the help; "0.5 …" and "VALUE…" are written so, and a long ROS type is folded.
    cut = [line for line in text.splitlines() if re.search(r"[a-z]… ", line) and "Trajec…" not in line]
    assert not cut
    assert f"Usage: touchline {name} " in text
    assert len(text.splitlines()) > 4
    command = WHOLE.commands[name]
    for each in (command, *getattr(command, "commands", {}).values()):
        spelt = Counter(option for parameter in each.params for option in parameter.opts)
        assert [option for option, times in spelt.items() if times > 1] == [], each.name


def test_completion_is_offered() -> None:
    environment = {
        **os.environ,
        "_TOUCHLINE_COMPLETE": "complete_bash",
        "COMP_WORDS": "touchline re",
        "COMP_CWORD": "1",
    }
    command = [Path(sys.executable).with_name("touchline")]
    done = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=False, timeout=100)
    assert done.stdout.split() == ["record", "replay"]


def test_a_table_in_a_pipe_has_a_line_for_each_row() -> None:
    lines = shown(WHOLE, "topics", columns="40").splitlines()
    assert any("planner/progress" in line and "touchline_msgs/Progress" in line for line in lines)


def test_up_says_where_ros_2_connects() -> None:
    notice = Ros2Choice(ros2=True, ros_domain=7, ros2_listen="tcp/127.0.0.1:7777").notice(["tt2"])
    assert "find it under /tt2," in notice
    assert "export RMW_IMPLEMENTATION=rmw_zenoh_cpp" in notice
    assert "export ROS_DOMAIN_ID=7" in notice
    assert """export ZENOH_CONFIG_OVERRIDE='connect/endpoints=["tcp/127.0.0.1:7777"]'""" in notice
    assert Ros2Choice().notice(["tt2"]) == ""
    assert "find them under /r1, /club/r2," in Ros2Choice(ros2=True).notice(["r1", "club/r2"])
    assert "find them under /demo/r1, /demo/club/r2," in Ros2Choice(ros2=True, ros_namespace="/demo").notice(
        ["r1", "club/r2"]
    )


def test_every_message_package_carries_its_licence() -> None:
    packages = sorted((ROOT / "schemas" / "msg").iterdir())
    assert len(packages) == 3
    for package in packages:
        described = ET.parse(package / "package.xml").getroot()
        licence, maintainer = described.find("license"), described.find("maintainer")
        assert licence is not None and maintainer is not None and maintainer.text
        assert (package / licence.attrib["file"]).read_text() == (ROOT / "LICENSE").read_text()


def test_the_list_of_all_commands_is_read_from_their_texts_and_says_the_same() -> None:
    assert shown(get_command(overview()), "--help") == shown(WHOLE, "--help")
    code = "import sys; sys.argv[1:] = ['-h']; import touchline.cli as c\ntry: c.main()\nfinally: print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"touchline.schemas.messages", "numba", "numpy", "zenoh"} & set(loaded)
