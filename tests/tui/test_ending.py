"""Ends of the console without its operator: a closed terminal, a breakdown; without colours it goes on."""

import fcntl
import io
import os
import pty
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest

from tests.tui.console import console
from touchline.bus.ports import free_port
from touchline.schemas.errors import TouchlineError
from touchline.tui.console import check_encoding, check_end
from touchline.tui.driver import HUNG_UP, Screen
from touchline.tui.template_dialog import TemplateDialog

ENDED_S = 60.0


def until_shown(terminal: int, text: bytes) -> None:
    """Read from a terminal until it has shown something."""
    shown = b""
    while text not in shown:
        shown += os.read(terminal, 65536)


@pytest.mark.parametrize("controlling", [False, True])
def test_a_closed_terminal_ends_the_console(controlling: bool) -> None:
    """With a dialog open, no bus, and whether or not there is a signal to tell of it."""
    terminal, end = pty.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    begin = (
        "import fcntl, sys, termios; "
        f"{controlling} and fcntl.ioctl(0, termios.TIOCSCTTY, 0); "
        "sys.argv = ['touchline', 'tui']; from touchline.cli import main; main()"
    )
    environment = os.environ | {"TOUCHLINE_ENDPOINT": f"tcp/127.0.0.1:{free_port()}", "TERM": "xterm-256color"}
    process = subprocess.Popen(
        [sys.executable, "-c", begin],
        stdin=end,
        stdout=end,
        stderr=end,
        env=environment,
        cwd=Path(__file__).parents[2],
        start_new_session=True,
    )
    try:
        os.close(end)
        until_shown(terminal, b"choose a template")
        os.write(terminal, b"t")
        until_shown(terminal, b"path/to/template.json")
        os.close(terminal)
        assert process.wait(ENDED_S) == HUNG_UP
    finally:
        process.kill()


class Gone(io.StringIO):
    """A terminal that is not there any more."""

    def write(self, text: str) -> int:
        raise OSError(5, "Input/output error")

    def flush(self) -> None:
        raise OSError(5, "Input/output error")


def test_a_picture_for_a_terminal_that_is_gone_is_lost_without_an_error() -> None:
    screen = Screen(Gone())
    assert screen.write("picture") == 7
    screen.flush()


async def test_without_colours_it_works_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    async with console() as (app, _link, pilot):
        await pilot.press("t")
        await pilot.pause()
        assert isinstance(app.screen, TemplateDialog)
        await pilot.press("escape", "question_mark")
        await pilot.pause()
        for y in range(app.size.height):
            for segment in app.screen._compositor.render_strips()[y]:
                colors = [color for color in (segment.style.color, segment.style.bgcolor) if color and color.triplet]
                assert all(len(set(color.triplet)) == 1 for color in colors)


def test_a_terminal_without_utf_8_is_told_what_is_needed() -> None:
    check_encoding(io.TextIOWrapper(io.BytesIO(), encoding="utf-8"))
    with pytest.raises(TouchlineError, match=r"the locale says iso8859-1; set LC_ALL=C.UTF-8"):
        check_encoding(io.TextIOWrapper(io.BytesIO(), encoding="iso8859-1"))


async def test_a_breakdown_is_told_in_one_line() -> None:
    async with console() as (app, _link, _pilot):
        app._return_code, app._exception = 1, ValueError("no\nsuch thing")
        with pytest.raises(TouchlineError, match="down: ValueError: no such thing; the robot goes on"):
            check_end(app)
        app._exception = None
        with pytest.raises(TouchlineError, match="its input failed"):
            check_end(app)
        app.exit(return_code=HUNG_UP)
        with pytest.raises(SystemExit) as told:
            check_end(app)
        assert told.value.code == HUNG_UP
        app.exit()
        check_end(app)
