"""Web pages cannot reach robots through the viewers' server, and viewers only look unless they may do more."""

import http.client
import socket
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from tests.bridge.viewer_client import ViewerClient, viewer
from touchline.bus import Bus, BusConfig
from touchline.bus.ports import free_port
from touchline.schemas import topics
from touchline.schemas.errors import SpecError
from touchline.services.bridge.foxglove import FoxgloveConfig, serve_viewers
from touchline.services.bridge.foxglove.viewer_guard import Refusal, refusal_of

FOREIGN = (
    "https://evil.example",
    "http://evil.example:8765",
    "null",
    "",
    "https://app.foxglove.dev.evil.example",
    "https://evilapp.foxglove.dev",
    "http://app.foxglove.dev",
    "https://app.foxglove.dev@evil.example",
    "http://localhost.evil.example",
    "http://localhost@evil.example",
    "http://127.0.0.1.evil.example",
    "http://192.168.1.7",
    "http://0.0.0.0:8080",
    "http://[::2]",
    "http://[evil",
    "file://evil.example",
    "chrome-extension://abcdef",
    "https://viewer.example.evil.example",
    "http://viewer.example",
)
KNOWN = (
    None,  # a program and not a page
    "https://app.foxglove.dev",
    "file://",
    "http://localhost:8080",
    "https://localhost",
    "http://127.0.0.1:3000",
    "http://[::1]:8080",
    "HTTPS://Viewer.example",
)


@pytest.fixture(scope="module")
def bus() -> Iterator[Bus]:
    with Bus.open(topics.OBSERVER, BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}", namespaces=("r1",))) as bus:
        yield bus


@pytest.fixture
def url(bus: Bus) -> Iterator[str]:
    with serve_viewers([bus], FoxgloveConfig("127.0.0.1:0", origins=("https://viewer.example",))) as viewers:
        yield viewers.url


def joined(url: str, origin: Any) -> bool:
    """Return whether a client of that origin is served."""
    try:
        with connect(url, origin=origin, subprotocols=[Subprotocol("foxglove.sdk.v1")], close_timeout=1.0) as socket:
            return b"serverInfo" in socket.recv(timeout=60.0).encode()
    except InvalidStatus as error:
        assert error.response.status_code == 403
        return False


def test_pages_of_foreign_origins_are_refused_and_known_viewers_served(
    url: str, caplog: pytest.LogCaptureFixture
) -> None:
    assert [origin for origin in FOREIGN if joined(url, origin)] == []
    assert [origin for origin in KNOWN if not joined(url, origin)] == []
    assert not joined(url, "https://evil.example")
    told = caplog.messages
    line = (
        "a viewer's web page of https://evil.example is refused; --foxglove-origin https://evil.example would allow it"
    )
    assert told.count(line) == 1
    assert len(told) == len(FOREIGN)


def head(*lines: str) -> bytes:
    return "\r\n".join(["GET / HTTP/1.1", "Host: x", *lines, "", ""]).encode()


def refused(given: bytes) -> Refusal | None:
    return refusal_of(given, "127.0.0.1", (), "")


def test_a_handshake_hides_no_origin() -> None:
    upgrade = "Upgrade: websocket"
    assert refused(head(upgrade)) is None
    assert refused(head("origin: http://localhost", "UPGRADE: WebSocket")) is None
    for lines in (
        ["Connection: keep-alive"],
        [upgrade, "Origin: http://localhost", "Origin: https://evil.example"],
        [upgrade, "X: y\nOrigin: https://evil.example"],
        [upgrade, "X: y\rOrigin: https://evil.example"],
        [upgrade, "X: y", " Origin: https://evil.example"],
        [upgrade, "Origin : https://evil.example"],
        [upgrade, "Origin:\thttps://evil.example"],
        [upgrade, "Origin"],
    ):
        assert refused(head(*lines)) is not None, lines
    assert refused(head(upgrade).replace(b"GET", b"POST")) is not None


def test_requests_that_are_no_handshake_reach_nobody(url: str) -> None:
    host, _, port = url.removeprefix("ws://").rpartition(":")
    client = http.client.HTTPConnection(host, int(port), timeout=60)
    client.request("GET", "/")
    assert client.getresponse().status == 403
    with socket.create_connection((host, int(port)), timeout=60) as raw:
        raw.sendall(b"GET / HTTP/1.1\r\nX: " + b"x" * 100_000)
        with suppress(ConnectionResetError):
            assert raw.recv(1) == b""


def test_a_viewer_only_looks_unless_it_may_do_more(bus: Bus) -> None:
    def offered(config: FoxgloveConfig) -> set[str]:
        with serve_viewers([bus], config) as viewers, viewer(viewers.url) as client:
            client.until(lambda: client.services)
            return set(client.services)

    every = {f"/r1/{service.name}" for service in (*topics.SERVICES, *topics.REPLAY_SERVICES)}
    looking = {f"/r1/{service.name}" for service in topics.READ_ONLY_SERVICES}
    assert {name.replace("-", "_") for name in looking} == offered(FoxgloveConfig("127.0.0.1:0"))
    assert {name.replace("-", "_") for name in every} == offered(FoxgloveConfig("127.0.0.1:0", orders=True))
    assert not {service for service in topics.ROBOT_SERVICES if f"/r1/{service.name}" in looking}


def test_viewers_are_let_go_when_serving_ends(bus: Bus) -> None:
    with serve_viewers([bus], FoxgloveConfig("127.0.0.1:0")) as viewers:
        socket = connect(viewers.url, subprotocols=[Subprotocol("foxglove.sdk.v1")])
        client = ViewerClient(socket)
        client.until(lambda: client.server)
    with pytest.raises(ConnectionClosed):
        client.until(lambda: False)
    with pytest.raises((OSError, InvalidHandshake)):
        connect(viewers.url)


def test_what_is_no_origin_is_refused_with_an_example() -> None:
    for wrong in ("viewer.example", "*", "https://viewer.example/page", "https://a b"):
        with pytest.raises(SpecError, match=r"give it as browsers send it, such as https://viewer\.example"):
            FoxgloveConfig(origins=(wrong,))
    tls = {"certificate": Path("/a"), "key": Path("/b"), "token": Path("/c")}
    config = FoxgloveConfig(orders=True, origins=("https://a.example", "https://b.example"), **tls, identity="viewer.a")
    assert config.arguments()[3:] == [
        "--foxglove-orders",
        *("--foxglove-origin", "https://a.example", "--foxglove-origin", "https://b.example"),
        *("--foxglove-cert", "/a", "--foxglove-key", "/b", "--foxglove-token", "/c"),
        *("--viewer-identity", "viewer.a"),
    ]
