"""Doors of the bridge on a secured bus: viewers and ROS 2 nodes come in with a token, by TLS, in their own name."""

import socket
import ssl
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import monotonic, sleep

import pytest
from websockets.exceptions import InvalidMessage, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from tests.bridge.viewer_client import viewer
from touchline.bus import Bus, BusConfig
from touchline.bus.ports import free_port
from touchline.bus.ros2 import Ros2Endpoint, Ros2Session
from touchline.bus.router import open_router
from touchline.schemas import topics
from touchline.schemas.bus_variables import OPEN_VARIABLE
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import CommandRequest, CommandResponse
from touchline.schemas.roles import Role
from touchline.schemas.topics import Service
from touchline.security.authority import CertificateAuthority, issued_for_system
from touchline.security.identity import Identity
from touchline.services.bridge.door_identity import buses_as
from touchline.services.bridge.foxglove import FoxgloveConfig, ViewerAccess, serve_viewers
from touchline.services.bridge.gateway import Gateway, GatewayConfig
from touchline.services.bridge.rmw_zenoh import RosNode, gid

pytestmark = pytest.mark.xdist_group("doors")
SERVED = (topics.PAUSE, topics.RESUME, topics.GOTO)
EVERYWHERE = "0.0.0.0:0"
HERE = "127.0.0.1:0"


@dataclass
class Secured:
    """A secured bus with a robot that obeys and notes who has asked."""

    keys: Path
    identities: dict[Role | str, Identity]
    bridge: Bus
    asked: list[tuple[str, str]] = field(default_factory=list)

    def folder(self, role: Role) -> str:
        """Return the folder of an identity."""
        return str(self.identities[role].folder)

    def until(self, condition: Callable[[], object], turn: Callable[[], object] = lambda: None) -> None:
        """Wait for something."""
        deadline = monotonic() + 60.0
        while not condition():
            turn()
            assert monotonic() < deadline, f"waited in vain; asked: {self.asked}"
            sleep(0.002)


@pytest.fixture(scope="module")
def secured(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Secured]:
    config_home = tmp_path_factory.mktemp("config")
    keys, done = config_home / "touchline" / "keys", threading.Event()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CONFIG_HOME", str(config_home))
        CertificateAuthority.create(keys, f"tls/127.0.0.1:{free_port()}")
        identities = issued_for_system(keys, ["tt2"])
        config = BusConfig(identities[Role.ROUTER].access.router)
        with (
            open_router(config.as_identity(identities[Role.ROUTER])),
            Bus.open(topics.ROBOT_SIM, config.as_identity(identities["tt2"])) as robot,
            Bus.open(topics.BRIDGE, config.as_identity(identities[Role.BRIDGE])) as bridge,
        ):
            secured = Secured(keys, identities, bridge)
            servers = [robot.serve(service) for service in SERVED]

            def obey() -> None:
                while not done.wait(0.002):
                    for server in servers:
                        if (call := server.poll()) is not None:
                            secured.asked.append((call.caller, server.service.name))
                            call.reply(server.service.response(success=True, message="done"))

            thread = threading.Thread(target=obey)
            thread.start()
            try:
                yield secured
            finally:
                done.set()
                thread.join()


def token_of(secured: Secured) -> str:
    return (secured.keys / "viewers.token").read_text().strip()


def admitted(url: str, context: ssl.SSLContext | None = None, tries: int = 3, **headers: str) -> str:
    """Return why a client is refused; empty if it is not.

    A connection that ends without an answer is no refusal: as viewers do, it is tried again.
    """
    wanted = {name.replace("_", "-"): value for name, value in headers.items()}
    try:
        with connect(
            url,
            ssl=context,
            additional_headers=wanted,
            subprotocols=[Subprotocol("foxglove.sdk.v1")],
            close_timeout=0.1,
            open_timeout=60.0,
        ) as client:
            assert "serverInfo" in str(client.recv(timeout=60.0))
    except InvalidStatus as error:
        return f"{error.response.status_code} {error.response.body.decode()}"
    except InvalidMessage:
        assert tries > 1, "the connection ends without an answer, again and again"
        return admitted(url, context, tries - 1, **headers)
    return ""


def test_a_viewer_orders_in_its_own_name_what_its_role_may(secured: Secured) -> None:
    config = FoxgloveConfig(HERE, orders=True, identity=secured.folder(Role.VIEWER))
    with serve_viewers([secured.bridge], config) as viewers:
        assert viewers.url_hint == f"{viewers.url}/?token=TOKEN, with the token in {secured.keys}/viewers.token"
        with viewer(f"{viewers.url}/?token={token_of(secured)}") as client:
            assert client.call("/tt2/traversal/pause", request_id="").message == "done"
            assert secured.asked[-1] == ("viewer.main", "traversal/pause")
            assert "/tt2/traversal/resume" not in client.services
            assert all(
                Role.VIEWER in service.callers
                for service in (*topics.SERVICES, *topics.REPLAY_SERVICES)
                if f"/tt2/{service.name.replace('-', '_')}" in client.services
            )


def test_without_a_viewers_identity_nobody_orders(secured: Secured) -> None:
    with pytest.raises(SpecError, match=r"--foxglove-orders is given on a secured bus; give --viewer-identity NAME"):
        ViewerAccess.of(FoxgloveConfig(HERE, orders=True), secured.bridge.config)
    with (
        serve_viewers([secured.bridge], FoxgloveConfig(HERE)) as viewers,
        viewer(f"{viewers.url}/?token={token_of(secured)}") as client,
    ):
        client.until(lambda: client.services)
        assert len(client.services) == len(topics.READ_ONLY_SERVICES)


def test_the_token_is_required_on_a_secured_bus(secured: Secured, caplog: pytest.LogCaptureFixture) -> None:
    with serve_viewers([secured.bridge], FoxgloveConfig(HERE)) as viewers:
        url, token = viewers.url, token_of(secured)
        assert (secured.keys / "viewers.token").stat().st_mode & 0o777 == 0o600
        none, wrong = admitted(url), admitted(f"{url}/?token={token[:-1]}")
        assert none.startswith(
            "401 a viewer at 127.0.0.1 is refused: it has no token; connect to this address with /?tok"
        )
        assert wrong.startswith("401 a viewer at 127.0.0.1 is refused: it has a wrong token")
        assert admitted(url, authorization=f"Bearer {token}x") == wrong
        assert admitted(f"{url}/?token=&token=%ff") == wrong
        assert admitted(f"{url}/?token={token}", origin="https://evil.example").startswith("403 a viewer's web page of")
        assert admitted(f"{url}/?token={token}", origin="https://app.foxglove.dev") == ""
        assert admitted(url, authorization=f"Bearer {token}") == ""
    assert {f"401 {line}\n" for line in caplog.messages} >= {none, wrong}
    assert token not in caplog.text


def test_beyond_this_machine_viewers_connect_by_tls(secured: Secured, caplog: pytest.LogCaptureFixture) -> None:
    config = FoxgloveConfig(EVERYWHERE, identity=secured.folder(Role.VIEWER))
    knows = ssl.create_default_context(cafile=secured.keys / "ca.pem")
    with serve_viewers([secured.bridge], config) as viewers:
        assert viewers.url.startswith("wss://0.0.0.0:")
        address = viewers.url.removeprefix("wss://0.0.0.0:")
        url = f"wss://127.0.0.1:{address}"
        assert admitted(f"{url}/?token={token_of(secured)}", knows) == ""
        assert admitted(url, knows).startswith("401 ")
        plain = admitted(f"ws://127.0.0.1:{address}/?token={token_of(secured)}")
        assert plain == "403 a viewer at 127.0.0.1 is refused: there is only TLS here, it has to connect by wss://\n"
        with pytest.raises(ssl.SSLError):
            admitted(f"{url}/?token={token_of(secured)}", ssl.create_default_context())
        secured.until(lambda: "fails to set up TLS" in caplog.text)

        def shown() -> bytes | None:
            with (
                socket.create_connection(("127.0.0.1", int(address))) as raw,
                knows.wrap_socket(raw, server_hostname="127.0.0.1") as encrypted,
            ):
                return encrypted.getpeercert(binary_form=True)

        before = shown()
        with CertificateAuthority.changing(secured.keys) as authority:
            authority.renew([authority.named("viewer.main")])
        assert shown() != before


@pytest.mark.parametrize(
    ("config", "on_secured", "named"),
    [
        (FoxgloveConfig(EVERYWHERE), False, r"--foxglove-listen is 0\.0\.0\.0:0, .* without TLS; give --foxglove-cert"),
        (FoxgloveConfig(EVERYWHERE), True, r"without TLS; give --viewer-identity NAME \(touchline keys issue viewer"),
        (FoxgloveConfig("[::]:0"), False, r"or --open-to-network: then anybody there looks on$"),
        (FoxgloveConfig(EVERYWHERE, orders=True), False, r"looks on, and commands$"),
        (FoxgloveConfig(identity="viewer.main"), False, r"--viewer-identity is given on an open bus"),
        (
            FoxgloveConfig(identity="bridge.main"),
            True,
            r"--viewer-identity is bridge\.main; give one of the role viewer",
        ),
        (FoxgloveConfig(identity="viewer.nobody"), True, r"viewer\.nobody is no identity"),
    ],
)
def test_doors_that_would_be_open_are_refused(
    secured: Secured, config: FoxgloveConfig, on_secured: bool, named: str
) -> None:
    bus = secured.bridge.config if on_secured else BusConfig()
    with pytest.raises(SpecError, match=named):
        ViewerAccess.of(config, bus)


def test_files_that_protect_nothing_are_refused(secured: Secured, tmp_path: Path) -> None:
    short, open_to_all, mine = tmp_path / "short", tmp_path / "open", tmp_path / "made"
    short.write_text("secret\n")
    short.chmod(0o600)
    open_to_all.write_text("x" * 32)
    open_to_all.chmod(0o640)
    key, certificate = (secured.identities[Role.VIEWER].folder / name for name in ("key.pem", "certificate.pem"))
    for config, named in (
        (FoxgloveConfig(token=short), "holds no token; write 16 to 256"),
        (FoxgloveConfig(token=open_to_all), r"is open to others \(mode 640\); chmod 600"),
        (FoxgloveConfig(token=tmp_path / "nowhere" / "token"), "cannot be written"),
        (FoxgloveConfig(certificate=certificate, key=open_to_all), r"is open to others \(mode 640\)"),
        (FoxgloveConfig(certificate=certificate, key=short), "make no TLS"),
        (FoxgloveConfig(certificate=tmp_path / "none", key=key), "make no TLS"),
    ):
        with pytest.raises(SpecError, match=named):
            ViewerAccess.of(config, BusConfig())
    with pytest.raises(SpecError, match="--foxglove-key is given without --foxglove-cert"):
        FoxgloveConfig(key=key)
    assert ViewerAccess.of(FoxgloveConfig(token=mine), BusConfig()).token == mine.read_text().strip()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(OPEN_VARIABLE, "1")
        assert ViewerAccess.of(FoxgloveConfig(EVERYWHERE), BusConfig()) == ViewerAccess()


def test_own_certificates_open_a_door_on_an_open_bus_with_a_token(secured: Secured) -> None:
    key, certificate = (secured.identities[Role.VIEWER].folder / name for name in ("key.pem", "certificate.pem"))
    access = ViewerAccess.of(FoxgloveConfig(EVERYWHERE, certificate=certificate, key=key), BusConfig())
    assert access.token == token_of(secured)
    assert access.url("10.0.0.1", 8765) == "wss://10.0.0.1:8765"


def test_the_gateway_needs_an_identity_and_leave_to_be_open(secured: Secured) -> None:
    bus, open_to_all = secured.bridge.config, GatewayConfig(Ros2Endpoint("tcp/0.0.0.0:7447"))
    with pytest.raises(SpecError, match=r"--ros2 is given on a secured bus; give --gateway-identity NAME \(touchline"):
        GatewayConfig().checked(bus)
    with pytest.raises(SpecError, match=r"--gateway-identity is viewer\.main; give one of the role gateway"):
        GatewayConfig(identity="viewer.main").checked(bus)
    for config, where in ((open_to_all, BusConfig()), (replace(open_to_all, identity="gateway.main"), bus)):
        with pytest.raises(SpecError, match=r"--ros2-listen is tcp/0\.0\.0\.0:7447, beyond .* --open-to-network"):
            config.checked(where)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(OPEN_VARIABLE, "1")
        assert open_to_all.checked(BusConfig()) is None


def test_ros_2_nodes_order_what_is_listed_in_the_gateways_name(secured: Secured) -> None:
    endpoint = Ros2Endpoint(f"tcp/127.0.0.1:{free_port()}")
    config = GatewayConfig(endpoint, services=("traversal/[pr]*",), identity="gateway.main")
    with (
        buses_as(config.checked(secured.bridge.config), [secured.bridge], lambda: False) as asking,
        Ros2Session.open(endpoint) as session,
        Ros2Session.open(replace(endpoint, listen=False)) as ros,
    ):
        gateway = Gateway(secured.bridge, asking[0], session, config)
        node = RosNode(0, "/tt2", "touchline", ros.id)

        def asked(service: Service[CommandRequest, CommandResponse]) -> CommandResponse:
            client = ros.client(node.service_key(service), node.servers(service), gid(node.client_token(1, service)))
            secured.until(client.served, gateway.turn)
            response = client.ask(encode(CommandRequest()), 60.0)

            def turn() -> None:
                gateway.turn()
                gateway.pass_urgent()

            secured.until(response.poll, turn)
            assert response.payload is not None, response.problem
            return decode(CommandResponse, response.payload)

        for service in (topics.PAUSE, topics.RESUME):
            assert asked(service).message == "done"
            assert secured.asked[-1] == ("gateway.main", service.name)

        def offered() -> list[str]:
            return [service.name for service in topics.SERVICES if ros.tokens(node.servers(service))]

        secured.until(lambda: len(offered()) >= 3, gateway.turn)
        assert offered() == ["traversal/pause", "traversal/resume", "traversal/reset"]
        assert ros.tokens(node.servers(topics.PARAMETER_SERVICES[0])) == []


def test_by_default_ros_2_nodes_only_look_on(secured: Secured) -> None:
    names = [service.name for service in (*topics.SERVICES, *topics.PARAMETER_SERVICES, topics.FOLLOWER_STEP)]
    looking = [each.name for each in (*topics.READ_ONLY_SERVICES, *topics.PARAMETER_SERVICES)]
    assert [name for name in names if GatewayConfig().offers(name, secured=True)] == looking
    assert all(GatewayConfig().offers(name, secured=False) for name in names)
