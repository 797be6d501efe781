"""Network namespaces of a test, each of them a machine; they vanish with the test."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterable
from contextlib import ExitStack

import pytest


class Namespaces:
    """Network namespaces by name, without any link yet."""

    def __init__(self, stack: ExitStack, names: Iterable[str]) -> None:
        if os.geteuid() != 0 or not all(map(shutil.which, ("ip", "unshare", "nsenter"))):
            pytest.skip("only root can make network namespaces, by ip, unshare and nsenter")
        self._stack = stack
        self.holders = {name: self._hold() for name in names}

    def _hold(self) -> int:
        """Process that holds a namespace, which vanishes with it."""
        holder = subprocess.Popen(["unshare", "--net", "sh", "-c", "echo; exec sleep 3600"], stdout=subprocess.PIPE)
        self._stack.callback(holder.wait)
        self._stack.callback(holder.kill)
        assert holder.stdout is not None
        with holder.stdout:
            if not holder.stdout.readline():
                pytest.skip("network namespaces cannot be made here")
        return holder.pid

    def ip(self, name: str, *lines: str) -> None:
        """Run lines of `ip -batch` in a namespace."""
        subprocess.run([*self.on(name), "ip", "-batch", "-"], input="\n".join(lines), text=True, check=True)

    def on(self, name: str) -> list[str]:
        """Beginning of a command that runs in a namespace."""
        return ["nsenter", f"--net=/proc/{self.holders[name]}/ns/net", "--"]
