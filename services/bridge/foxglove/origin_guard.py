"""Guard in front of Foxglove's SDK: listens for viewers, and passes on those whose handshake names an allowed origin.

Browsers let any page open a WebSocket to this machine and name its origin in the header Origin; the SDK does not look
at it. Programs that are no browsers send none.
"""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Callable, Collection
from contextlib import suppress
from typing import Final

from touchline.schemas.plain_text import plain
from touchline.services.bridge.foxglove.viewer_origins import is_allowed, is_origin

Address = tuple[str, int]
_LARGEST_HEAD_BYTES: Final = 16 * 1024
_HEAD_S: Final = 10.0
_MOST_CONNECTIONS: Final = 256
_PASSED_BYTES: Final = 64 * 1024
_FORBIDDEN: Final = b"HTTP/1.1 403 Forbidden\r\nContent-Type: text/plain; charset=utf-8\r\nConnection: close\r\n"
_END_OF_HEAD: Final = b"\r\n\r\n"


class OriginGuard:
    """Accepts connections in a thread of its own until `stop`.

    Args:
        host: Host to listen on.
        port: Port to listen on; 0: any free one.
        origins: Allowed beside those of `is_allowed`.
        warn: Called once with a line about each refused origin; in that thread.

    Attributes:
        inner: Address to which allowed connections are passed on; while it is None, all are closed.

    Raises:
        OSError: The address cannot be listened on.
    """

    def __init__(self, host: str, port: int, origins: Collection[str], warn: Callable[[str], None]) -> None:
        self.inner: Address | None = None
        self._origins, self._warn = origins, warn
        self._refused: set[str] = set()
        self._tasks: set[asyncio.Task[None]] = set()
        family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        self._socket = socket.create_server(address[:2], family=family)
        self._loop = asyncio.new_event_loop()
        self._stopping = asyncio.Event()
        self._thread = threading.Thread(target=self._loop.run_until_complete, args=(self._serve(),), daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        """The port that it listens on."""
        return int(self._socket.getsockname()[1])

    def stop(self) -> None:
        """Close all connections and stop listening; harmless when repeated."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stopping.set)
            self._thread.join()
            self._loop.close()

    async def _serve(self) -> None:
        server = await asyncio.start_server(self._take, sock=self._socket, limit=_LARGEST_HEAD_BYTES)
        await self._stopping.wait()
        server.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _take(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        try:
            if len(self._tasks) <= _MOST_CONNECTIONS:
                await self._check(reader, writer)
        except (OSError, TimeoutError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            pass  # it came to nothing
        except asyncio.CancelledError:
            pass  # `stop` waits for it; Python 3.11's streams print a traceback for a handler that ends as cancelled
        finally:
            self._tasks.discard(task)
            writer.close()

    async def _check(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Pass a connection on, or refuse its handshake."""
        head = await asyncio.wait_for(reader.readuntil(_END_OF_HEAD), _HEAD_S)
        refusal = refusal_of(head, self._origins)
        if refusal:
            self._warn_once(refusal)
            text = f"{refusal}\n".encode()
            response = (
                f"HTTP/1.1 403 Forbidden\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: {len(text)}\r\n"
            )
            writer.write(response.encode() + b"Connection: close\r\n\r\n" + text)
            await asyncio.wait_for(writer.drain(), _HEAD_S)
        elif self.inner is not None:
            their_reader, their_writer = await asyncio.open_connection(*self.inner, limit=_PASSED_BYTES)
            try:
                their_writer.write(head)
                await _both_directions((reader, their_writer), (their_reader, writer))
            finally:
                their_writer.close()

    def _warn_once(self, refusal: str) -> None:
        if refusal not in self._refused and len(self._refused) < _MOST_CONNECTIONS:
            self._refused.add(refusal)
            self._warn(refusal)


async def _both_directions(*directions: tuple[asyncio.StreamReader, asyncio.StreamWriter]) -> None:
    """Pass bytes on unread until one side has ended; a side that takes none delays the other."""
    passing = [asyncio.ensure_future(_pass(*direction)) for direction in directions]
    try:
        await asyncio.wait(passing, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in passing:
            task.cancel()
        await asyncio.gather(*passing, return_exceptions=True)


async def _pass(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with suppress(OSError):
        while data := await reader.read(_PASSED_BYTES):
            writer.write(data)
            await writer.drain()


def refusal_of(head: bytes, origins: Collection[str]) -> str:
    """Return why a handshake is refused; empty if it is not.

    Args:
        head: The request up to its empty line.
        origins: Allowed ones.
    """
    request, *lines = head.removesuffix(_END_OF_HEAD).split(b"\r\n")
    fields = [line.partition(b":") for line in lines]
    strange = any(not name or name != name.strip() or not colon for name, colon, _ in fields)
    if strange or not request.startswith(b"GET ") or any(end in head.replace(b"\r\n", b"") for end in (b"\r", b"\n")):
        return "a viewer's connection is refused: it is no WebSocket handshake"
    values = [(name.lower(), value.strip()) for name, _, value in fields]
    if not any(name == b"upgrade" and value.lower() == b"websocket" for name, value in values):
        return "a viewer's connection is refused: it is no WebSocket handshake"
    for origin in [value.decode("latin-1") for name, value in values if name == b"origin"]:
        if not is_allowed(origin, origins):
            shown = plain(origin, 200)
            remedy = f"; --foxglove-origin {shown} would allow it" if is_origin(origin) else ""
            return f"a viewer's web page of {shown or 'no origin'} is refused{remedy}"
    return ""
