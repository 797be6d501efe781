"""Ends of processes, and the ways in which they hear of them."""

import os
import signal
import subprocess
import sys
from textwrap import dedent

from touchline.schemas import topics
from touchline.supervision.shutdown import Stop, until_stopped
from touchline.supervision.temporary_system import LocalSystem


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
    system = LocalSystem((Silent(),), None, {}, (topics.ROBOT_SIM,))
    assert system.wait_until_ready(print, lambda: not asked.append(1)) is False
    assert len(asked) == 1


def run_as_command(body):
    """A process of ``touchline`` whose command is the function `command` of this text; others are not loaded."""
    begin = "import ctypes, os, signal, sys\nfrom types import SimpleNamespace\nimport touchline.cli\n"
    end = "\nsys.modules['touchline.cli.commands'] = SimpleNamespace(execute=command)\ntouchline.cli.main()\n"
    script = begin + dedent(body) + end
    return subprocess.run(
        [sys.executable, "-c", script, "command"], capture_output=True, text=True, check=False, timeout=100
    )


def test_an_interruption_that_python_ignores_comes_again():
    """As in a callback; the command went on as if nobody had told it to end."""
    done = run_as_command("""
        @ctypes.CFUNCTYPE(None)
        def called_back():
            os.kill(os.getpid(), signal.SIGTERM)
            while True:
                pass

        def command():
            called_back()
            while True:
                pass
    """)
    assert (done.returncode, done.stderr) == (143, "interrupted\n")


def test_the_compiler_is_not_interrupted_but_what_comes_after_it():
    done = run_as_command("""
        from numba.core.compiler_lock import global_compiler_lock

        def command():
            with global_compiler_lock:
                os.kill(os.getpid(), signal.SIGTERM)
                print("compiled", flush=True)
            while True:
                pass
    """)
    assert (done.returncode, done.stdout, done.stderr) == (143, "compiled\n", "interrupted\n")


def test_what_trips_over_an_interruption_is_interrupted():
    done = run_as_command("""
        def command():
            try:
                os.kill(os.getpid(), signal.SIGTERM)
                while True:
                    pass
            except KeyboardInterrupt:
                raise RuntimeError("no compiled object yet") from None
    """)
    assert (done.returncode, done.stderr) == (143, "interrupted\n")
