"""Guard in front of Foxglove's SDK: listens for viewers, and passes on those with an allowed origin and the token.

Browsers let any page open a WebSocket to this machine and name its origin in the header Origin; the SDK does not look
at it. Programs that are no browsers send none. TLS ends here, since the SDK cannot show a handshake to be checked.
"""

from __future__ import annotations

import asyncio
import hmac
import socket
import ssl
import threading
from collections.abc import Callable, Collection
from contextlib import suppress
from typing import Final, NamedTuple
from urllib.parse import parse_qs, urlsplit

from touchline.schemas.plain_text import plain
from touchline.services.bridge.foxglove.viewer_access import ViewerAccess
from touchline.services.bridge.foxglove.viewer_origins import is_allowed, is_origin

Address = tuple[str, int]
_LARGEST_HEAD_BYTES: Final = 16 * 1024
_HEAD_S: Final = 10.0
_MOST_CONNECTIONS: Final = 256
_PASSED_BYTES: Final = 64 * 1024
_END_OF_HEAD: Final = b"\r\n\r\n"
_TLS_HANDSHAKE: Final = b"\x16"
#: After accepting has failed for want of file descriptors.
_AGAIN_S: Final = 0.1


class Refusal(NamedTuple):
    """Refusal of a handshake.

    Attributes:
        status: HTTP status.
        reason: Why, and the remedy; for the client and the log.
    """

    status: str
    reason: str


class ViewerGuard:
    """Accepts connections in a thread of its own until `stop`.

    Args:
        address: Host and port to listen on; port 0: any free one.
        origins: Allowed beside those of `is_allowed`.
        access: What is required of viewers beside that.
        warn: Called once with a line about each refusal; in that thread.

    Attributes:
        inner: Address to which allowed connections are passed on; while it is None, all are closed.

    Raises:
        OSError: The address cannot be listened on.
    """

    def __init__(
        self, address: Address, origins: Collection[str], access: ViewerAccess, warn: Callable[[str], None]
    ) -> None:
        self.inner: Address | None = None
        self._origins, self._access, self._warn = origins, access, warn
        self._refused: set[str] = set()
        self._tasks: set[asyncio.Task[None]] = set()
        family, *_, found = socket.getaddrinfo(*address, type=socket.SOCK_STREAM)[0]
        self._socket = socket.create_server(found[:2], family=family)
        self._socket.setblocking(False)
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
            self._socket.close()

    async def _serve(self) -> None:
        accepting = asyncio.ensure_future(self._accept())
        await self._stopping.wait()
        tasks = [accepting, *self._tasks]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _accept(self) -> None:
        while True:
            try:
                connection, (host, *_) = await self._loop.sock_accept(self._socket)
            except OSError:
                await asyncio.sleep(_AGAIN_S)
                continue
            if len(self._tasks) < _MOST_CONNECTIONS:
                task = asyncio.ensure_future(self._take(connection, str(host)))
                self._tasks.add(task)
                task.add_done_callback(self._tasks.discard)
            else:
                connection.close()

    async def _take(self, connection: socket.socket, host: str) -> None:
        """Pass a connection on, or refuse it."""
        writer = None
        try:
            encrypted = await _first_byte(connection) == _TLS_HANDSHAKE
            context = self._access.tls_context() if encrypted else None
            if encrypted and context is None:
                self._warn_once(f"a viewer at {host} is refused: there is no TLS here, it has to connect by ws://")
                return
            reader = asyncio.StreamReader(_LARGEST_HEAD_BYTES)
            protocol = asyncio.StreamReaderProtocol(reader)
            transport, _ = await self._loop.connect_accepted_socket(
                lambda: protocol, connection, ssl=context, ssl_handshake_timeout=_HEAD_S if context else None
            )
            writer = asyncio.StreamWriter(transport, protocol, reader, self._loop)
            await self._check(reader, writer, host, encrypted=context is not None)
        except ssl.SSLError as error:
            self._warn_once(f"a viewer at {host} fails to set up TLS ({error.reason}); does it trust the certificate?")
        except (OSError, TimeoutError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            pass  # it came to nothing
        finally:
            if writer is not None:
                writer.close()
            else:
                connection.close()

    async def _check(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, host: str, *, encrypted: bool
    ) -> None:
        """Pass on what comes, or refuse the handshake."""
        head = await asyncio.wait_for(reader.readuntil(_END_OF_HEAD), _HEAD_S)
        if self._access.certificate is not None and not encrypted:
            reason = f"a viewer at {host} is refused: there is only TLS here, it has to connect by wss://"
            refusal: Refusal | None = Refusal("403 Forbidden", reason)
        else:
            refusal = refusal_of(head, host, self._origins, self._access.token)
        if refusal is not None:
            self._warn_once(refusal.reason)
            text = f"{refusal.reason}\n".encode()
            lines = (
                f"HTTP/1.1 {refusal.status}",
                "Content-Type: text/plain; charset=utf-8",
                f"Content-Length: {len(text)}",
                "Connection: close",
            )
            writer.write("\r\n".join(lines).encode() + _END_OF_HEAD + text)
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


async def _first_byte(connection: socket.socket) -> bytes:
    """Return the first byte that comes, which remains to be read; empty if there is none."""
    loop, readable = asyncio.get_running_loop(), asyncio.Event()
    loop.add_reader(connection, readable.set)
    try:
        await asyncio.wait_for(readable.wait(), _HEAD_S)
    finally:
        loop.remove_reader(connection)
    return connection.recv(1, socket.MSG_PEEK)


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


def refusal_of(head: bytes, host: str, origins: Collection[str], token: str) -> Refusal | None:
    """Return why a handshake is refused; None if it is not.

    Args:
        head: The request up to its empty line.
        host: Address of the client.
        origins: Allowed ones.
        token: What the client must present; empty if nothing.
    """
    request, *lines = head.removesuffix(_END_OF_HEAD).split(b"\r\n")
    fields = [line.partition(b":") for line in lines]
    strange = any(not name or name != name.strip() or not colon for name, colon, _ in fields)
    values = [(name.lower(), value.strip()) for name, _, value in fields]
    upgrade = any(name == b"upgrade" and value.lower() == b"websocket" for name, value in values)
    broken = any(end in head.replace(b"\r\n", b"") for end in (b"\r", b"\n"))
    if strange or broken or not upgrade or not request.startswith(b"GET "):
        return Refusal("403 Forbidden", "a viewer's connection is refused: it is no WebSocket handshake")
    for origin in [value.decode("latin-1") for name, value in values if name == b"origin"]:
        if not is_allowed(origin, origins):
            shown = plain(origin, 200)
            remedy = f"; --foxglove-origin {shown} would allow it" if is_origin(origin) else ""
            return Refusal("403 Forbidden", f"a viewer's web page of {shown or 'no origin'} is refused{remedy}")
    if not token:
        return None
    presented = _presented(request, values)
    if any(hmac.compare_digest(each, token.encode()) for each in presented):
        return None
    which = "a wrong token" if presented else "no token"
    reason = f"a viewer at {host} is refused: it has {which}; connect to this address with /?token=TOKEN behind it"
    return Refusal("401 Unauthorized", reason)


def _presented(request: bytes, values: Collection[tuple[bytes, bytes]]) -> list[bytes]:
    """Return the tokens in a handshake's address, and in the header of programs that can set one."""
    try:
        target = urlsplit(request.split(b" ")[1].decode("ascii"))
    except (ValueError, IndexError):
        return []
    headers = [value.removeprefix(b"Bearer ") for name, value in values if name == b"authorization"]
    return [*(each.encode() for each in parse_qs(target.query).get("token", ())), *headers]
