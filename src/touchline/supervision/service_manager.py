"""Messages to systemd, by the protocol of sd_notify(3): ready, and alive."""

import os
import socket
import time
from contextlib import suppress
from typing import Final, Self

_PERIODS: Final = 4
"""Messages in a watchdog's time."""


class ServiceManager:
    """Service manager that has started this process; call `beat` in every turn of the loop.

    Args:
        address: Address of its socket, as in `NOTIFY_SOCKET`.
        watchdog_s: Time without a message after which it ends this process; None: it waits for none.
    """

    def __init__(self, address: str, watchdog_s: float | None) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC | socket.SOCK_NONBLOCK)
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        self._period_s = watchdog_s / _PERIODS if watchdog_s is not None else float("inf")
        self._due_s = 0.0

    @classmethod
    def from_environment(cls) -> Self | None:
        """Return that of this process, if it has one; child processes do not inherit it."""
        address, watchdog_us = os.environ.pop("NOTIFY_SOCKET", ""), os.environ.pop("WATCHDOG_USEC", "")
        mine = os.environ.pop("WATCHDOG_PID", "") in ("", str(os.getpid()))
        return cls(address, float(watchdog_us) / 1e6 if mine and watchdog_us.isdigit() else None) if address else None

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def beat(self) -> None:
        """Report at the first call that the service is ready, and then as often as the watchdog needs; never waits."""
        now_s = time.monotonic()
        if now_s >= self._due_s:
            message = b"WATCHDOG=1" if self._due_s else b"READY=1"
            self._due_s = now_s + self._period_s
            with suppress(OSError):  # its queue is full, or it is gone
                self._socket.sendto(message, self._address)
