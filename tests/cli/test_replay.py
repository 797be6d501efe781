"""A replay as a process of its own, what controls it from elsewhere, and its keys."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

from tests.meeting import eventually
from touchline.bus import Bus
from touchline.cli.replay_keys import ReplayKeys
from touchline.recordings.replay.replay_player import ReplayPlayer
from touchline.recordings.replay.replay_source import ReplaySource
from touchline.schemas import topics

SESSION = Path(__file__).resolve().parents[2] / "examples" / "sessions" / "square.mcap"


def test_a_replay_is_controlled_from_elsewhere(touchline_on_bus, bus_config):
    assert touchline_on_bus("playback", "pause")[0] == 2  # there is none
    command = [sys.executable, "-m", "touchline", "replay", str(SESSION), "--paused", "--json"]
    environment = {**os.environ, **bus_config.environment()}
    process = subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE)
    try:
        with Bus.open(topics.OBSERVER, bus_config) as bus:
            presence = bus.presence()
            assert eventually(lambda: (presence.poll() and False) or topics.REPLAY in presence.alive())
        code, out, _ = touchline_on_bus("playback", "seek", "12")
        assert (code, out) == (0, "seek: paused at 12.0 s of 20.4 s, 1×\n")
        assert touchline_on_bus("playback", "seek", "-2")[1] == "seek: paused at 10.0 s of 20.4 s, 1×\n"
        assert touchline_on_bus("playback", "step", "--seconds", "0.5")[1] == "step: paused at 10.5 s of 20.4 s, 1×\n"
        assert touchline_on_bus("playback", "loop", "3")[0] == touchline_on_bus("playback", "speed", "5")[0] == 0
        assert touchline_on_bus("playback", "speed", "0")[0] == touchline_on_bus("playback", "seek", "noon")[0] == 2
        told = json.loads(touchline_on_bus("playback", "status", "--json")[1])
        assert (told["file"], told["robots"], told["playing"], told["jumps"]) == ("square.mcap", ["tt2"], False, 2)
        assert (told["now_s"], told["speed"], told["loops"]) == (10.5, 5.0, 3)
        code, out, _ = touchline_on_bus("status")
        assert code == 0 and "paused square.mcap, 10.5 of 20.4 s" in " ".join(out.split())
        assert "not on the bus" not in out and "traversal: running" in out
        for order in ("start", "estop"):
            code, _, err = touchline_on_bus("order", order)
            assert (code, "refused: tt2 is a replay" in err) == (1, True)
        # Two under one name; on a busy machine one may not hear of the other in time.
        assert eventually(lambda: "already running" in touchline_on_bus("replay", str(SESSION), "--speed", "max")[2])
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=60)
        assert (process.returncode, b'"sent"' in output) == (130, True)
    finally:
        process.kill()
        process.wait()


def test_a_stretch_that_holds_nothing_is_refused(touchline_on_bus):
    code, _, err = touchline_on_bus("replay", str(SESSION), "--from", "30")
    assert (code, "it goes from 0.000 s to 20.400 s" in err) == (2, True)
    assert touchline_on_bus("replay", str(SESSION), "--from", "nan")[0] == 2


def test_keys_move_a_replay():
    player, keys = ReplayPlayer(ReplaySource(SESSION)), ReplayKeys()
    keys.press(b" \x1b[C\x1b[C", player)
    assert (player.playing, player.now_s, player.jumps) == (False, 20.0, 2)
    keys.press(b"\x1bOD++-", player)
    assert (player.now_s, player.speed) == (10.0, 2.0)
    keys.press(b".", player)
    assert player.stepping
    keys.press(b"\x1b[99~zq", player)
    assert keys.quit
