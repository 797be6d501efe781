"""The terminal's end, on a pipe."""

import fcntl
import os
import sys
import termios
import threading
import time
from types import SimpleNamespace

from textual.events import Key

from tests.tui.console import console
from tests.tui.scenes import up
from touchline.tui.driver import SturdyDriver


def waiting(fileno):
    """Bytes in the pipe that nobody has read."""
    return int.from_bytes(fcntl.ioctl(fileno, termios.FIONREAD, bytes(4)), sys.byteorder)


def test_input_that_is_no_text_costs_nothing_but_itself():
    driver = SturdyDriver.__new__(SturdyDriver)  # without a terminal to take over
    driver.fileno, writer = os.pipe()
    driver.exit_event, driver._debug = threading.Event(), False
    keys, heard = [], threading.Event()

    def process_message(message):
        if isinstance(message, Key):
            keys.append(message.key)
            heard.set()

    driver.process_message = process_message
    thread = threading.Thread(target=driver.run_input_thread)
    thread.start()
    for sent in (b"\xff\xfe", b"e"):
        os.write(writer, sent)
        while waiting(driver.fileno):
            time.sleep(0.001)
    assert heard.wait(60.0)
    driver.exit_event.set()
    thread.join(60.0)
    os.close(writer)
    os.close(driver.fileno)
    assert keys == ["e"]


async def test_the_console_is_woken_once_for_many_keys(monkeypatch):
    async with console(*up()) as (app, _, _):
        assert app.get_driver_class() is SturdyDriver
        driver, sent, woken = SturdyDriver(app, size=(80, 24)), [], []
        driver.send_message = sent.append
        monkeypatch.setattr(driver, "_loop", SimpleNamespace(call_soon_threadsafe=woken.append))
        typed = [Key(name, None) for name in "abcdefgh"]
        for key in typed[:5]:
            driver.process_message(key)
        assert len(woken) == 1
        woken.pop()()
        for key in typed[5:]:
            driver.process_message(key)
        assert len(woken) == 1
        woken.pop()()
        assert sent == typed
