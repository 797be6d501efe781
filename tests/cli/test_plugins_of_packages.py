"""Plug-ins of installed packages: the page's own example is installed, listed, planned and driven with."""

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from tests.system.commands import touchline_here
from touchline.schemas import entry_points
from touchline.schemas.plugins import BrokenPlugin, Plugin, Registry

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "guides" / "plugins.md").read_text(encoding="utf-8")
LAWN = {
    "name": "lawn",
    "segments": [{"id": "edge", "line": {"start": [0, 1], "end": [0.6, 1]}}],
    "areas": [{"id": "lawn", "outline": [[0, 0], [0.6, 0], [0.6, 0.24], [0, 0.24]]}],
}


def install(folder: Path, name: str, points: dict[str, dict[str, str]], files: dict[str, str]) -> Path:
    """A package as an installer leaves it."""
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    info = folder / f"{name.replace('-', '_')}-0.1.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 0.1\n", encoding="utf-8")
    sections = (f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in each.items()) for group, each in points.items())
    (info / "entry_points.txt").write_text("\n".join(sections), encoding="utf-8")
    return folder


@pytest.fixture
def example(tmp_path: Path) -> Path:
    """The package of the page."""
    blocks = re.findall(r"```(?:toml|python)\n# ([\w/.]+)\n(.*?)```", PAGE, re.S)
    files = dict(blocks)
    project = tomllib.loads(files.pop("pyproject.toml"))["project"]
    assert len(files) == 5
    return install(tmp_path / "site", project["name"], project["entry-points"], files)


#: Commands given as JSON, one after the other: exit code and both outputs of each.
ONE_PROCESS = """
import io, json, sys
from contextlib import redirect_stderr, redirect_stdout
from touchline.cli.commands import execute

done = []
for arguments in json.loads(sys.argv[1]):
    sys.argv[1:] = arguments
    with redirect_stdout(io.StringIO()) as output, redirect_stderr(io.StringIO()) as errors:
        code = execute()
    done.append((code, output.getvalue(), errors.getvalue()))
print(json.dumps(done))
"""


def touchline(site: Path, *commands: tuple[str, ...], cwd: Path | None = None) -> "list[CompletedProcess[str]]":
    """Commands in one process that has the packages of a folder."""
    environment = {**os.environ, "PYTHONPATH": str(site), "COLUMNS": "300", "NO_COLOR": "1", "TERM": "dumb"}
    process = [sys.executable, "-c", ONE_PROCESS, json.dumps(commands)]
    said = subprocess.run(process, env=environment, cwd=cwd, stdout=subprocess.PIPE, text=True, check=True, timeout=600)
    return [CompletedProcess(each, *done) for each, done in zip(commands, json.loads(said.stdout), strict=True)]


def test_the_pages_package_paints_and_a_session_checked_without_it_names_it(example: Path, tmp_path: Path) -> None:
    (tmp_path / "lawn.json").write_text(json.dumps(LAWN), encoding="utf-8")
    chosen = ("--method", "gentle", "--area-method", "there", "--follower", "careful", "--record", "lawn.mcap")
    (tmp_path / "glare.json").write_text('{"faults": [{"kind": "glare", "start_s": 2, "duration_s": 1}]}')
    simulate = ("simulate", "lawn.json", *chosen, "--scenario", "glare.json", "--json")
    done, there = touchline(example, simulate, ("check", "lawn.mcap"), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "warning" not in done.stderr
    figures = json.loads(done.stdout)
    assert figures["success"]
    assert {each["id"] for each in figures["segments"]} == {"edge", "lawn#1", "lawn#2"}
    info = json.loads(touchline_here("info", str(tmp_path / "lawn.mcap"), "--json").stdout)
    assert info["metadata"]["touchline_made_by"]["plugin gentle-turns"] == "0.1"
    assert there.returncode == 0, there.stderr
    without = touchline_here("check", str(tmp_path / "lawn.mcap"))
    assert without.returncode == 1
    told = without.stdout + without.stderr
    assert "gentle-turns 0.1 (not installed here)" in told
    assert "Traceback" not in told


def test_the_pages_package_is_listed_and_a_broken_one_told_and_left_out(example: Path, tmp_path: Path) -> None:
    points = {
        "touchline.transition_methods": {
            "absent": "nowhere:METHOD",
            "bare": "odd_turns:NUMBER",
            "gentle": "odd_turns:PLUGIN",
            "late": "odd_turns:LATE",
        }
    }
    lines = (
        "from touchline.schemas.plugins import Plugin",
        "NUMBER, PLUGIN, LATE = 3, Plugin('', 1), Plugin('late', 'odd_turns:NO')\n",
    )
    install(example, "odd-turns", points, {"odd_turns.py": "\n".join(lines)})
    shown, planned = touchline(example, ("simulate", "--help"), ("plan", "study-square", "--method", "late"))
    assert shown.returncode == 0
    told = " ".join(shown.stdout.replace("│", " ").split())
    for words in ("gentle: turns of twice the radius", "there: rows, all the same way", "careful: pursuit that"):
        assert words in told
    assert "absent" not in shown.stdout
    warnings = shown.stderr.splitlines()
    assert len(warnings) == 3
    for line, name, problem in zip(
        warnings,
        ("absent", "bare", "gentle"),
        ("ModuleNotFoundError: No module named 'nowhere'", "names a int", "of that name already"),
        strict=True,
    ):
        assert line.startswith(f'warning: the transition method "{name}" of the package odd-turns 0.1 is left out: ')
        assert problem in line
    assert planned.returncode == 2
    assert planned.stderr.splitlines()[-1].startswith(
        'error: importing the transition method "late" of the package odd-turns 0.1 fails with AttributeError'
    )
    assert "Traceback" not in planned.stderr


def test_a_plug_in_that_fails_in_use_is_a_line_that_names_its_package(example: Path, tmp_path: Path) -> None:
    (tmp_path / "lawn.json").write_text(json.dumps(LAWN), encoding="utf-8")
    with (example / "gentle_turns" / "method.py").open("a", encoding="utf-8") as file:
        file.write("\n\ndef connect(self, start, goal):\n    return 1 / 0\n\n\nGentleTurns.connect = connect\n")
    (example / "gentle_turns" / "rows.py").write_text("def rows(area, width_m):\n    return 1 / 0\n")
    chosen = {'transition method "gentle"': ("--method", "gentle"), 'area method "there"': ("--area-method", "there")}
    commands = (("plan", "lawn.json", *options, "-q") for options in chosen.values())
    for which, planned in zip(chosen, touchline(example, *commands, cwd=tmp_path), strict=True):
        assert planned.returncode == 2
        assert planned.stderr == (
            f"error: plan cannot use the {which} of the package gentle-turns 0.1: "
            "it fails with ZeroDivisionError: division by zero; mend it, or use another one\n"
        )


def offered(monkeypatch: pytest.MonkeyPatch, *found: entry_points.Offer) -> list[str]:
    """Let registries find these; which groups were looked for."""
    asked: list[str] = []

    def offers(group: str) -> list[entry_points.Offer]:
        asked.append(group)
        return list(found)

    monkeypatch.setattr("touchline.schemas.plugins.offers", offers)
    return asked


def test_packages_are_looked_for_once_and_only_if_need_be(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = offered(monkeypatch, entry_points.Offer("theirs", "p 1", lambda: Plugin("theirs", 2.0)))
    registry: Registry[float] = Registry("shade of grey")
    registry.register("ours", "shipped", 1.0)
    assert registry.default == "ours"
    assert (registry.find("ours"), asked) == (1.0, [])
    assert registry.find("theirs") == 2.0
    assert registry.names() == ("ours", "theirs")
    assert asked == ["touchline.shade_of_greys"]


def test_whatever_an_import_does_the_others_are_there(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def leaves() -> object:
        raise SystemExit("enough")

    def fails() -> object:
        raise ZeroDivisionError("by\nzero")

    asked = offered(
        monkeypatch,
        entry_points.Offer("a", "p 1", leaves),
        entry_points.Offer("b", "p 1", fails),
        entry_points.Offer("c d", "p 1", lambda: Plugin("", 1.0)),
        entry_points.Offer("e", "p 1", lambda: Plugin("fine", "math:tau")),
        entry_points.Offer("f", "p 1", lambda: Plugin("gone", "math:no")),
    )
    registry: Registry[float] = Registry("number")
    assert registry.names() == ("e", "f")
    assert len(asked) == 1
    lines = caplog.messages
    assert [line.split('"')[1] for line in lines] == ["a", "b", "c d"]
    assert "ZeroDivisionError: by zero; mend or uninstall the package" in lines[1]
    assert registry.find("e") > 6.0
    with pytest.raises(BrokenPlugin, match='importing the number "f" of the package p 1 fails with AttributeError'):
        registry.find("f")
