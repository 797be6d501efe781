"""The tutorials run to their ends, and the guide's and README's lines are those of the product."""

import re
import runpy
import shlex
from pathlib import Path

import pytest

from touchline.cli.commands import command_line
from touchline.cli.settings_file import command_of

ROOT = Path(__file__).parents[2]
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.py"))
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
MOST_WORDS = 700


@pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda each: each.stem)
def test_a_tutorial_runs_to_its_end(tutorial: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tempfile.mkdtemp", lambda: str(tmp_path))
    runpy.run_path(str(tutorial), run_name="__main__")


def blocks(page: Path, kind: str) -> list[str]:
    return re.findall(rf"^```{kind}\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)


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
