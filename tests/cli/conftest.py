"""The command in this process."""

import sys

import pytest

from touchline.cli.commands import execute


@pytest.fixture
def touchline(monkeypatch, capsys):
    """Run the command in this process: (exit code, standard output, standard error)."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["touchline", *arguments])
        code = execute()
        return code, *capsys.readouterr()

    return run


@pytest.fixture
def touchline_on_bus(touchline, monkeypatch, bus_config):
    """Run the command on a bus of its own."""
    for name, value in bus_config.environment().items():
        monkeypatch.setenv(name, value)
    return touchline
