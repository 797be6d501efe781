"""Joining a bus where strangers listen, keep silent, or are on other machines."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
from contextlib import ExitStack

import pytest
import zenoh

from tests.meeting import caught_up
from touchline.bus import Bus, BusConfig
from touchline.bus.common_settings import MAX_MESSAGE_BYTES
from touchline.bus.remote_access import beyond_loopback, is_loopback
from touchline.schemas import topics
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.messages import CommandRequest, CommandResponse


def port_of(config: BusConfig) -> int:
    return int(config.endpoint.rpartition(":")[2])


def laid_over(tmp_path, text: str, config: BusConfig) -> zenoh.Config:
    path = tmp_path / "zenoh.json5"
    path.write_text(text)
    return BusConfig(endpoint=config.endpoint, config_file=path).zenoh()


def test_an_empty_configuration_file_changes_nothing(tmp_path, bus_config):
    assert str(laid_over(tmp_path, "{}", bus_config)) == str(bus_config.zenoh())


def test_a_configuration_file_is_laid_over_ours_key_by_key(tmp_path, bus_config):
    text = '{scouting: {delay: 77}, listen: {endpoints: ["tcp/127.0.0.1:1"]}, transport: {unicast: {max_sessions: 5}}}'
    config, ours = laid_over(tmp_path, text, bus_config), bus_config.zenoh()
    expected = json.loads(str(ours))
    expected["scouting"]["delay"] = 77
    expected["listen"]["endpoints"] = ["tcp/127.0.0.1:1"]
    expected["transport"]["unicast"]["max_sessions"] = 5
    assert json.loads(str(config)) == expected


def test_larger_messages_than_we_decode_are_not_put_together(bus_config):
    assert json.loads(bus_config.zenoh().get_json("transport/link/rx/max_message_size")) == MAX_MESSAGE_BYTES


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{}", []),
        ('{listen: {endpoints: ["tcp/0.0.0.0:7461"]}}', ["it listens on tcp/0.0.0.0:7461"]),
        ('{listen: {endpoints: {peer: ["tcp/[::]:1"], router: ["tcp/1.2.3.4:5"]}}}', ["it listens on tcp/[::]:1"]),
        (
            '{connect: {endpoints: ["tcp/robot.local:7447#iface=eth0"]}}',
            ["connects to tcp/robot.local:7447#iface=eth0"],
        ),
        ("{scouting: {multicast: {enabled: true}}}", ["multicast scouting is on"]),
    ],
    ids=["ours", "all interfaces", "by mode", "connect", "multicast"],
)
def test_who_can_reach_the_bus_is_known(tmp_path, bus_config, text, says):
    ways = beyond_loopback(laid_over(tmp_path, text, bus_config))
    assert len(ways) == len(says)
    assert all(part in way for way, part in zip(ways, says, strict=True))


@pytest.mark.parametrize("locator", ["tcp/127.1.2.3:1", "tcp/[::1]:1", "tls/localhost:1", "unixsock-stream//tmp/x"])
def test_loopback(locator):
    assert is_loopback(locator)


def test_more_than_loopback_is_refused_or_said_aloud(tmp_path, bus_config, caplog, monkeypatch):
    path = tmp_path / "zenoh.json5"
    path.write_text("{scouting: {multicast: {enabled: true}}}")
    exposed = BusConfig(endpoint=bus_config.endpoint, config_file=path)
    with (
        pytest.raises(TouchlineError, match=r"multicast scouting is on.*--open-to-network"),
        Bus.open("bridge", exposed),
    ):
        pass
    monkeypatch.setenv("TOUCHLINE_OPEN_TO_NETWORK", "1")
    with Bus.open("bridge", exposed):
        assert "can be reached from other machines: multicast scouting is on" in caplog.text
    caplog.clear()
    with Bus.open("bridge", bus_config):
        assert caplog.text == ""


@pytest.mark.parametrize(
    "text",
    [
        '{connect: {endpoints: ["tls/127.0.0.1:7461"]}}',
        '{listen: {endpoints: {peer: ["quic/127.0.0.1:7461"]}}}',
        "{transport: {link: {tls: {enable_mtls: true}}}}",
    ],
)
def test_tls_over_processes_that_all_listen_without_it_is_refused(tmp_path, bus_config, text):
    with pytest.raises(SpecError, match=r"TOUCHLINE_ZENOH_CONFIG.*open bus.*--secure"):
        laid_over(tmp_path, text, bus_config)
    with pytest.raises(SpecError, match=r"TOUCHLINE_ENDPOINT.*open bus.*--secure"):
        BusConfig(endpoint="tls/127.0.0.1:7461").zenoh()
    client = '{mode: "client", transport: {link: {tls: {enable_mtls: true}}}}'
    laid_over(tmp_path, client, bus_config)  # of a router secured by hand


def test_another_program_at_the_meeting_point_is_told(bus_config, monkeypatch, caplog):
    monkeypatch.setattr("touchline.bus.joining._ABORT_AFTER_S", 2.2)
    with (
        socket.create_server(("127.0.0.1", port_of(bus_config))),
        pytest.raises(TouchlineError, match=r"another program, or frozen.*TOUCHLINE_ENDPOINT"),
        Bus.open("bridge", bus_config),
    ):
        pass
    assert "does not answer" in caplog.text


def test_a_service_waits_for_a_router_until_it_is_interrupted_and_a_command_does_not(tmp_path, bus_config):
    path = tmp_path / "zenoh.json5"
    path.write_text("{mode: 'client'}")
    environment = {**os.environ, **BusConfig(endpoint=bus_config.endpoint, config_file=path).environment()}
    absent = f"nobody listens at {bus_config.endpoint} (Connection refused); start the router"
    service = [sys.executable, "-m", "touchline", "planner", "--logs", str(tmp_path)]
    with subprocess.Popen(service, env=environment, stderr=subprocess.PIPE, text=True) as planner:
        assert planner.stderr.readline() == f"warning: {absent}; still trying\n"
        planner.send_signal(signal.SIGTERM)
        assert planner.wait(60) == 130
    command = [sys.executable, "-m", "touchline", "goto", "1", "1"]
    goto = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=100)
    assert (goto.returncode, goto.stderr) == (2, f"error: {absent}\n")


def test_idle_connections_do_not_keep_a_peer_out(bus_config):
    """As many as wait to be opened at most kept everybody out for ten seconds, again and again."""
    address = ("127.0.0.1", port_of(bus_config))
    with Bus.open("robot-sim", bus_config) as robot, ExitStack() as idle:
        for _ in range(600):
            idle.enter_context(socket.create_connection(address))
        server, done = robot.serve(topics.ESTOP), threading.Event()

        def serve() -> None:
            while not done.is_set():
                if (call := server.wait(0.05)) is not None:
                    call.reply(CommandResponse(success=True))

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            with Bus.open("operator", bus_config) as operator:
                assert operator.call(topics.ESTOP, CommandRequest(request_id="now")).success
        finally:
            done.set()
            thread.join()


def test_few_descriptors_are_told_and_as_many_as_allowed_are_used(bus_config):
    code = (
        "import resource, sys\nfrom touchline.bus import Bus\n"
        "for hard in (4096, 64):\n"
        "    resource.setrlimit(resource.RLIMIT_NOFILE, (64, hard))\n"
        "    print(f'{hard}: ', end='', file=sys.stderr, flush=True)\n"
        "    with Bus.open('bridge'): print(resource.getrlimit(resource.RLIMIT_NOFILE)[0])"
    )
    environment = {**os.environ, **bus_config.environment()}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=100)
    assert done.stdout.split() == ["4096", "64"]
    enough, few = done.stderr.split("64: ")
    assert enough == "4096: " and "raise the limit of open files with ulimit -n" in few


def test_a_message_that_is_too_large_harms_nobody(bus_config):
    with Bus.open("robot-sim", bus_config) as robot, Bus.open("bridge", bus_config) as bridge:
        caught_up(robot, bridge)
        inbox = bridge.inbox([topics.EVENTS])
        caught_up(robot, bridge)
        with zenoh.open(bus_config.zenoh()) as stranger:
            stranger.put(bridge.key(topics.EVENTS.name), bytes(2 * MAX_MESSAGE_BYTES))
        caught_up(robot, bridge)
        assert inbox.drain() == []


def test_only_who_waits_for_a_router_goes_on_without_one(bus_config, tmp_path, monkeypatch, caplog):
    monkeypatch.setattr("touchline.bus.joining._REPORT_AFTER_S", 0.1)
    monkeypatch.setattr("touchline.bus.joining._ABORT_AFTER_S", 0.5)
    (client := tmp_path / "client.json5").write_text('{mode: "client"}')
    router = BusConfig(bus_config.endpoint, config_file=client)
    absent = r"nobody listens at tcp/127\.0\.0\.1:\d+ \(Connection refused\); start the router"
    with pytest.raises(TouchlineError, match=f"^{absent}$"), Bus.open("test", router):
        pass
    waited = iter([False] * 200)
    with pytest.raises(KeyboardInterrupt), Bus.open("test", router, lambda: next(waited, True)):
        pass
    assert re.search(f"{absent}; still trying", caplog.text)
    with (
        socket.create_server(("127.0.0.1", port_of(router))),
        pytest.raises(TouchlineError, match=r"what listens on tcp/.* does not answer; if it is another program"),
        Bus.open("test", router),
    ):
        pass
