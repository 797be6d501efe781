"""How processes find out that they are to end."""

import os
import signal
import subprocess
import sys

from services.lifecycle import Stop, until_stopped
from services.local import LocalSystem


def test_a_service_ends_that_finds_its_supervisor_gone():
    """Killed while the service was being loaded, say: its parent is another process by the time it looks."""
    assert Stop(supervisor=os.getpid())  # which is nobody's child here
    assert not Stop(supervisor=os.getppid())
    assert not Stop(supervisor=None)


def test_a_hang_up_is_an_end_in_order():
    with until_stopped() as stop:
        os.kill(os.getpid(), signal.SIGHUP)
        assert stop


def test_waiting_for_services_that_compile_can_be_ended():
    class Silent:
        def inbox(self, topics):
            return self

    asked = []
    system = LocalSystem(Silent(), None, None)
    assert system.wait_until_ready(print, lambda: not asked.append(1)) is False
    assert len(asked) == 1


TRIPPING = """
import os, signal
import services.cli
from services.cli import commands

def tripping():
    try:
        os.kill(os.getpid(), signal.SIGTERM)
        while True:
            pass
    except KeyboardInterrupt:
        raise RuntimeError("no compiled object yet") from None

commands.run_command = tripping
services.cli.main()
"""


LOSING = """
import ctypes, os, signal
import services.cli
from services.cli import commands

@ctypes.CFUNCTYPE(None)
def called_back():
    os.kill(os.getpid(), signal.SIGTERM)
    while True:
        pass

def losing():
    called_back()
    while True:
        pass

commands.run_command = losing
services.cli.main()
"""


def test_an_interruption_that_python_ignores_comes_again():
    """As in a callback; the command went on as if nobody had told it to end."""
    done = subprocess.run([sys.executable, "-c", LOSING], capture_output=True, text=True, check=False, timeout=100)
    assert (done.returncode, done.stderr) == (143, "interrupted\n")


COMPILING = """
import os, signal
from numba.core.compiler_lock import global_compiler_lock
import services.cli
from services.cli import commands

def compiling():
    with global_compiler_lock:
        os.kill(os.getpid(), signal.SIGTERM)
        print("compiled", flush=True)
    while True:
        pass

commands.run_command = compiling
services.cli.main()
"""


def test_the_compiler_is_not_interrupted_but_what_comes_after_it():
    done = subprocess.run([sys.executable, "-c", COMPILING], capture_output=True, text=True, check=False, timeout=100)
    assert (done.returncode, done.stdout, done.stderr) == (143, "compiled\n", "interrupted\n")


def test_what_trips_over_an_interruption_is_interrupted():
    done = subprocess.run([sys.executable, "-c", TRIPPING], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (143, "interrupted\n")
