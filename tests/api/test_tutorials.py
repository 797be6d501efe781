"""The site of the documentation, its notebooks included, and the commands and Python of the pages."""

import os
import re
import runpy
import shlex
import signal
import subprocess
import sys
import tempfile
import termios
from functools import partial
from pathlib import Path

import pytest

from touchline.bus.ports import free_port
from touchline.cli.commands import command_line
from touchline.cli.settings_file import command_of

ROOT = Path(__file__).parents[2]
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.py"))
#: What a page loads from another host; links that a reader may follow are none of it.
LOADED = re.compile(r"""<(?:link|script|img|iframe|source)\b[^>]*\b(?:src|href)=["'](?:https?:)?//[^>]*>""")
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
MOST_WORDS = 700
#: Looking through the nodes of all pages for garbage takes a quarter of the time.
BUILD = "import gc, sys; gc.disable(); from sphinx.cmd.build import main; sys.exit(main(sys.argv[1:]))"
#: Commands that last until they are ended.
LASTING = ("up", "tui")


def build(tmp_path: Path, builder: str, *options: str) -> None:
    """Build the site anew without a warning."""
    command = [sys.executable, "-c", BUILD, "-q", "-W", "--keep-going", "-b", builder]
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    built = subprocess.run(
        [*command, "-d", str(tmp_path / "doctrees"), *options, str(ROOT / "docs"), str(tmp_path)],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert built.returncode == 0, built.stderr


def test_every_page_is_read_and_every_link_within_the_site_leads_somewhere(tmp_path: Path) -> None:
    # Writing the pages takes as long again, and typographic quotation marks are for readers. Cells get their language
    # from the kernel that executes them.
    off = ("nb_execution_mode=off", "smartquotes=0", "suppress_warnings=myst-nb.lexer")
    build(tmp_path, "dummy", *(word for setting in off for word in ("-D", setting)))


@pytest.mark.full
def test_the_site_shows_what_notebooks_give_and_needs_no_other_host(tmp_path: Path) -> None:
    build(tmp_path, "html")
    pages = {page.relative_to(tmp_path): page.read_text(encoding="utf-8") for page in tmp_path.rglob("*.html")}
    assert "<svg style" in pages[Path("tutorials/first_hour.html")]
    assert not [(page, LOADED.findall(text)) for page, text in pages.items() if LOADED.search(text)]
    assert sorted(each.stem for each in tmp_path.rglob("*.ipynb")) == sorted(
        [*(each.stem for each in TUTORIALS), "gallery"]
    )


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_runs_as_a_program(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    runpy.run_path(str(page))


def blocks(page: Path, kind: str) -> list[str]:
    fenced = re.findall(r"^```([^\n]*)\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)
    return [text for info, text in fenced if re.fullmatch(kind, info)]


def test_every_command_of_a_page_is_one_with_such_options() -> None:
    commands, refused, read = command_of(command_line()).commands, [], 0  # type: ignore[union-attr]
    for page in PAGES:
        for line in "".join(blocks(page, "(?:sh|bash)?")).replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True) if line.startswith("touchline ") else []
            if len(words) < 2 or words[1].startswith("-") or any(mark in line for mark in ("…", " | ", " > ", "[")):
                continue
            command, arguments = commands.get(words[1]), words[2:]
            if getattr(command, "commands", None) and arguments:
                inner = command.commands.get(arguments[0])
                if inner is None and words[1] == "templates":
                    continue  # which takes the name of a template, too
                command, arguments = inner, arguments[1:]
            if "--help" in arguments or command is None:
                refused += [] if command is not None else [f"{page.name}: {line}"]
                continue
            read += 1
            try:
                command.make_context(words[1], arguments)
            except Exception as error:  # noqa: BLE001 - whatever is wrong with the line
                if "does not exist" not in str(error):
                    refused.append(f"{page.name}: {line}: {error}")
    assert not refused, "\n".join(refused)
    assert read > 60


def test_readme_is_short_and_its_python_runs() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.split()) <= MOST_WORDS
    (code,) = blocks(ROOT / "README.md", "python")
    exec(compile(code, "README.md", "exec"), {})


@pytest.mark.full
def test_the_commands_of_the_readme_run(tmp_path: Path) -> None:
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    commands = [shlex.split(line, comments=True) for line in lines if line.startswith("touchline ")]
    environment = os.environ | {"TOUCHLINE_ENDPOINT": f"tcp/127.0.0.1:{free_port()}", "TERM": "xterm-256color"}
    start = partial(subprocess.Popen, cwd=tmp_path, env=environment)
    here = str(Path(sys.executable).with_name("touchline"))
    assert [words[1] for words in commands if words[1] in LASTING] == list(LASTING)
    for _, *arguments in commands:
        if arguments[0] not in LASTING:
            assert start([here, *arguments]).wait() == 0, arguments
    with start([here, "up"]) as system:
        terminal, inner = os.openpty()
        termios.tcsetwinsize(inner, (24, 80))
        with start([here, "tui"], stdin=inner, stdout=inner, stderr=inner) as console:
            shown = b""
            while b"choose a template" not in shown:  # what an idle robot waits for
                shown += os.read(terminal, 65536)
            console.terminate()
        system.send_signal(signal.SIGINT)
    assert system.returncode == 0
