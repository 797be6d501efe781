"""Small installations do what they promise, and say what to install for the rest."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

from touchline.schemas import optional_packages

ROOT = Path(__file__).parents[2]
EXTRAS: dict[str, list[str]] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"][
    "optional-dependencies"
]
#: Modules by extra; llvmlite comes with Numba.
MODULES = {
    "console": ("textual",),
    "drawings": ("PIL", "cssselect2", "ezdxf", "tinycss2"),
    "live": ("xxhash", "zenoh"),
    "numba": ("llvmlite", "numba"),
    "plot": ("matplotlib",),
    "scipy": ("scipy",),
    "secure": ("cryptography",),
    "sim": ("daqp", "jinja2", "shapely"),
}
SQUARE = "examples/sessions/square.mcap"

HIDDEN = """
import sys
from importlib.machinery import PathFinder

hidden = sys.argv[1].split()

class Others(PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        return None if name.partition(".")[0] in hidden else super().find_spec(name, path, target)

sys.meta_path[sys.meta_path.index(PathFinder)] = Others
"""
COMMANDS = """
import io, json
from contextlib import redirect_stderr, redirect_stdout
from touchline.cli.commands import execute

done, commands = [], json.loads(sys.argv[2])
for command in commands:
    sys.argv[1:] = command.split()
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()) as said:
        code = execute()
    done.append((code, said.getvalue()))
print(json.dumps(done))
"""


def with_extras(extras: tuple[str, ...], code: str, *arguments: str) -> Any:
    """Output of code, read as JSON, from a process that has the modules of these extras only."""
    hidden = " ".join(module for extra, modules in MODULES.items() if extra not in extras for module in modules)
    command = [sys.executable, "-c", HIDDEN + code, hidden, *arguments]
    return json.loads(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, cwd=ROOT).stdout)


def done_with(extras: tuple[str, ...], *commands: str) -> list[tuple[int, str]]:
    """Exit code and standard error of each command."""
    return [(code, said) for code, said in with_extras(extras, COMMANDS, json.dumps(commands))]


def test_standard_has_every_extra_of_the_product() -> None:
    assert EXTRAS["standard"] == [f"touchline[{','.join(sorted(MODULES))}]"]
    packages = {optional_packages._PACKAGES.get(each, each) for modules in MODULES.values() for each in modules}
    assert packages == {line.split(">")[0] for extra in MODULES for line in EXTRAS[extra]}


def test_without_any_extra_recordings_are_read_and_the_rest_says_in_a_line_what_to_install(tmp_path: Path) -> None:
    sufficient = (
        "--version",
        f"info {SQUARE}",
        f"export {SQUARE} --topic clock --csv {tmp_path}/clock.csv",
        f"salvage {SQUARE} {tmp_path}/salvaged.mcap",
        f"compare {SQUARE} {SQUARE}",
        f"echo {SQUARE} clock --count 1",
        f"hz {SQUARE}",
        "templates",
        "templates salt-pan-l",
        "vehicle",
        "topics",
        "fault --list",
        "config",
        "doctor",
    )
    lacking = (
        f"export {SQUARE} --viewer a.mcap",
        f"check {SQUARE}",
        "simulate tennis",
        "plan tennis",
        "sweep tennis",
        "goto 1 1",
        "fleet simulate",
        f"estimate {SQUARE}",
        f"picture {SQUARE} --out a.svg",
        "study",
        "run tennis",
        "demo",
        "up",
        "status",
        "order start",
        f"replay {SQUARE}",
        "playback pause",
        "echo --robot tt2 clock",
        "tui",
        "bridge",
        "keys init",
    )
    done = done_with((), *sufficient, *lacking)
    assert [code for code, _ in done[: len(sufficient)]] == [0] * len(sufficient), done
    assert (tmp_path / "clock.csv").stat().st_size > 1000
    for (code, said), command in zip(done[len(sufficient) :], lacking, strict=True):
        assert code == 2 and said.startswith("error: ") and " pip install '" in said, (command, said)
        assert said.count("\n") == 1, (command, said)


def test_planning_simulating_and_checking_take_no_more_than_their_extra() -> None:
    done = done_with(("sim", "numba"), "simulate study-square", "plan study-square", f"check {SQUARE} --workers 1")
    assert [code for code, _ in done] == [0] * 3, done
    [(code, said)] = done_with(("sim", "numba"), "simulate study-square --plot a.svg")
    assert code == 2 and said.startswith("error: --plot needs a package that is not installed: pip install 'matplotlib")


LIBRARY = """
import json, pickle, touchline

log = touchline.Recording("examples/sessions/square.mcap")
said = [len(log["clock"].array()) > 100, touchline.load_template("salt-pan-l").area_m2]
for name in ("check", "simulate", "connect"):
    try:
        getattr(touchline, name)
    except touchline.MissingExtra as error:
        again = pickle.loads(pickle.dumps(error))
        said.append([isinstance(error, (ImportError, touchline.TouchlineError)), str(again)])
print(json.dumps(said))
"""


def test_the_library_raises_the_same_error() -> None:
    read, area_m2, *refused = with_extras((), LIBRARY)
    assert read and area_m2 == pytest.approx(93 * 47.6 - 40 * 22)
    assert all(found and "pip install 'daqp" in said for found, said in refused)


def test_the_missing_packages_of_an_extra_are_named_together(monkeypatch: pytest.MonkeyPatch) -> None:
    needed = ["numpy>=2", 'daqp<1,>=0.11; extra == "sim"', 'Jinja2>=3; extra == "sim"', 'shapely>=2; extra == "sim"']
    monkeypatch.setattr(optional_packages, "requires", lambda _: needed)
    monkeypatch.setattr(optional_packages, "_installed", lambda name: name == "Jinja2")
    assert optional_packages._missing_with("daqp") == ["daqp<1,>=0.11", "shapely>=2"]
    assert optional_packages._missing_with("numpy") == ["numpy>=2"]
    assert optional_packages._missing_with("unknown") == []


def test_only_imports_of_touchline_are_refused_and_questions_answered() -> None:
    code = "import json\nfrom importlib.util import find_spec\nimport touchline\n"
    code += "try:\n    import scipy\nexcept ImportError as error:\n    found = type(error).__name__\n"
    code += "print(json.dumps([found, find_spec('scipy') is None]))"
    assert with_extras((), code) == ["ModuleNotFoundError", True]
