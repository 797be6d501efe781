"""Results on standard output, in plain lines where there is no terminal; all else on standard error."""

import csv
import io
import json
import sys

import pytest
import typer

from touchline.cli import display
from touchline.cli.commands import command_line
from touchline.schemas.messages import Event

#: Services, the console, and commands whose output is JSON in any case.
WITHOUT_JSON = {
    *("planner", "bridge", "coordinator", "router", "robot-sim", "tui", "up", "picture"),
    *("vehicle", "onboard", "fleet team", "fleet robots", "templates text", "templates import"),
    *("keys init", "keys issue", "keys renew", "keys revoke"),
}


def commands(command, path=()):
    """Every subcommand, by its name."""
    if not hasattr(command, "commands"):
        yield " ".join(path), command
        return
    for name, inner in command.commands.items():
        yield from commands(inner, (*path, name))


def test_every_command_can_be_quiet_and_verbose_and_print_json():
    found = dict(commands(typer.main.get_command(command_line())))
    assert len(found) > 40
    for name, command in found.items():
        options = {option for parameter in command.params for option in parameter.opts}
        assert {"--quiet", "-q", "--verbose", "-v"} <= options, name
        assert ("--json" in options) == (name not in WITHOUT_JSON), name


def test_a_report_in_a_pipe_is_a_line_a_figure_with_a_tab(touchline):
    code, out, _err = touchline("plan", "study-square")
    assert code == 0
    title, *lines = out.splitlines()
    assert title == "Plan of Square of the study, 1 x 1 m"
    figures = dict(line.split("\t") for line in lines)
    assert figures["segments.painted"] == "4"
    assert not any(line != line.strip() for line in out.splitlines())


@pytest.mark.parametrize("arguments", [("templates",), ("topics",)])
def test_a_table_in_a_pipe_has_no_boxes_and_no_padding(touchline, arguments):
    code, out, _err = touchline(*arguments)
    assert code == 0
    assert "  " not in out and not set(out) & set("│─━╭╰┃╇")
    assert all("\t" in row for row in out.splitlines())


def test_a_dash_is_standard_output_and_figures_go_to_standard_error(touchline):
    code, out, err = touchline("plan", "study-square", "--out", "-")
    assert code == 0
    assert json.loads(out)["path"]["segments"]
    assert "segments.painted\t4" in err


def test_a_dash_is_no_file(touchline, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, _err = touchline("sweep", "study-square", "--seeds", "1", "--csv", "-", "--workers", "1")
    assert code == 0
    (row,) = csv.DictReader(io.StringIO(out))
    assert row["success"] == "True"
    assert not list(tmp_path.iterdir())


def test_quiet_leaves_results_warnings_and_errors(touchline, capsys):
    touchline("plan", "study-square", "--quiet")
    display.say("a line")
    display.print_event(Event.INFO, "an event")
    display.print_event(Event.WARN, "a warning")
    with display.progress_bar("Work") as advance:
        advance(0.5, "half")
    assert capsys.readouterr().err == " warning a warning\n"
    code, _out, err = touchline("plan", "nowhere.json", "-q")
    assert code == 2 and err.startswith("error: nowhere.json is neither")


def test_verbose_shows_the_traceback_of_an_error(touchline):
    code, _, err = touchline("plan", "nowhere.json", "-v")
    assert code == 2
    assert err.startswith("Traceback") and "\nerror: nowhere.json is neither" in err
    code, _out, err = touchline("plan", "nowhere.json")
    assert err.startswith("error:")


def test_progress_without_a_terminal_is_a_line_now_and_then(touchline, capsys, monkeypatch):
    touchline("templates")
    capsys.readouterr()
    monkeypatch.setattr(display, "_LINE_EVERY_S", 0.0)
    with display.progress_bar("Study") as advance:
        advance(0.25, "ellipse")
    assert capsys.readouterr().err == "Study: 25% after 0 s  ellipse\n"
    monkeypatch.setattr(display, "_LINE_EVERY_S", 60.0)
    with display.progress_bar("Study") as advance:
        advance(0.25, "ellipse")
    assert capsys.readouterr().err == ""


def test_a_package_that_is_missing_is_told_before_anything_starts(touchline, tmp_path, monkeypatch):
    for module, *arguments in (
        ("foxglove", "up", "--foxglove"),
        ("distributed", "sweep", "study-square", "--dask", "tcp://127.0.0.1:1"),
        ("pyarrow", "export", "a.mcap", "--topic", "clock", "--parquet", str(tmp_path / "a.parquet")),
    ):
        monkeypatch.setitem(sys.modules, module, None)
        code, _out, err = touchline(*arguments)
        assert code == 2
        assert err.startswith(f"error: --{arguments[-2].lstrip('-') if len(arguments) > 2 else 'foxglove'} needs")
        assert "pip install '" in err and err.count("\n") == 1


def test_an_address_of_viewers_that_is_taken_is_told_before_anything_starts(touchline):
    import socket

    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        code, _out, err = touchline("up", "--foxglove", "--foxglove-listen", address)
    assert code == 2
    assert err == (
        f"error: command line: --foxglove-listen is {address}, where it cannot listen (Address already in use); "
        "give another address\n"
    )
