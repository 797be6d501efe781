"""Replays that pause, seek, step and begin anew: what they send, without a bus."""

import math
import random
from pathlib import Path

import pytest

from touchline.recordings.replay.held_messages import HeldMessages
from touchline.recordings.replay.replay_cue import Cue
from touchline.recordings.replay.replay_player import ReplayPlayer
from touchline.recordings.replay.replay_source import ReplaySource
from touchline.schemas import topics
from touchline.schemas.replay_run import ReplayRun

SESSIONS = Path(__file__).resolve().parents[2] / "examples" / "sessions"
STOPPED = SESSIONS / "stop-and-resume.mcap"


@pytest.fixture(params=["indexed", "broken"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A session, and what is left of it without its end, which has no index."""
    if request.param == "indexed":
        return STOPPED
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(STOPPED.read_bytes()[: STOPPED.stat().st_size * 9 // 10])
    return broken


def taken(player: ReplayPlayer, wall_s: float) -> list[Cue]:
    """All that is due."""
    cues = []
    while (cue := player.take(wall_s)) is not None:
        cues.append(cue)
    return cues


def test_after_a_seek_holds_what_holds_in_a_replay_that_ran_there(path: Path) -> None:
    source, draw = ReplaySource(path), random.Random(5)
    everything = list(source.from_start())
    assert source.length_s == everything[-1].at_s
    for at_s in (0.0, source.length_s, *(draw.uniform(0.0, source.length_s) for _ in range(5))):
        ran = HeldMessages()
        for cue in everything:
            if cue.at_s <= at_s:
                ran.take(cue)
        held, rest = source.jump(at_s)
        assert list(held) == list(ran.cues())
        assert list(rest) == [cue for cue in everything if cue.at_s > at_s]


def test_figures_of_a_job_hold_no_longer_when_the_next_one_runs() -> None:
    source = ReplaySource(STOPPED)
    for at_s in range(1, 16):
        held, _ = source.jump(float(at_s))
        last = {cue.topic: cue for cue in held}
        assert topics.CLOCK in last and topics.PLAN in last
        assert topics.REPORT not in last or last[topics.STATUS].at_s >= last[topics.REPORT].at_s


def test_it_keeps_the_pace_pauses_and_goes_on(path: Path) -> None:
    player = ReplayPlayer(ReplaySource(path), speed=2.0)
    taken(player, 100.0)
    taken(player, 101.5)
    assert player.now_s == pytest.approx(3.0)
    player.pause()
    assert not taken(player, 110.0) and player.now_s == pytest.approx(3.0)
    player.resume()
    assert not [cue for cue in taken(player, 200.0) if cue.at_s > 3.0]
    cues = taken(player, 200.5)
    assert {3 < cue.at_s <= 4 for cue in cues} == {True}
    player.set_speed(-1.0)
    taken(player, 200.5)
    assert player.ended and not player.playing and player.now_s == player.end_s


def test_steps_send_so_much_and_pause(path: Path) -> None:
    player = ReplayPlayer(ReplaySource(path))
    player.step(messages=7)
    assert player.stepping and len(taken(player, 0.0)) == 7 and not player.playing
    begin_s = player.now_s
    player.step(seconds=0.5)
    cues = taken(player, 0.0)
    assert player.now_s == pytest.approx(begin_s + 0.5)
    assert cues and cues[-1].at_s <= begin_s + 0.5 and not player.playing and not player.stepping


def test_a_seek_stays_within_the_recording_and_leaves_it_paused_or_playing(path: Path) -> None:
    player = ReplayPlayer(ReplaySource(path), playing=False)
    player.seek(1e9)
    taken(player, 0.0)
    assert (player.jumps, player.now_s, player.playing) == (1, player.end_s, False)
    player.resume()
    player.seek(-5.0)
    assert (player.jumps, player.now_s, player.playing, player.ended) == (2, player.begin_s, True, False)
    assert player.jumping
    taken(player, 0.0)
    assert not player.jumping


def test_passes_are_whole_and_begin_with_a_jump() -> None:
    player = ReplayPlayer(ReplaySource(STOPPED), speed=-1.0, loops=2)
    first = taken(player, 0.0)
    assert (player.loop, player.jumps) == (2, 1)
    assert taken(player, 0.0) == first
    taken(player, 0.0)
    assert player.ended
    assert player.played_s == pytest.approx(2 * player.end_s)


def test_a_stretch_begins_with_what_holds_and_ends_where_it_is_to() -> None:
    player = ReplayPlayer(ReplaySource(STOPPED), speed=-1.0, from_s=5.0, to_s=6.0)
    assert (player.begin_s, player.end_s, player.now_s) == (5.0, 6.0, 5.0)
    cues = taken(player, 0.0)
    assert topics.TEMPLATE in {cue.topic for cue in cues}
    assert max(cue.at_s for cue in cues) <= 6.0 and player.ended


def test_a_paused_replay_shows_what_there_is_at_the_beginning() -> None:
    player = ReplayPlayer(ReplaySource(STOPPED), playing=False)
    assert {cue.at_s for cue in taken(player, 0.0)} == {0.0}
    assert not player.playing and player.wait_s(0.0, 0.5) == 0.5


def test_the_id_of_publishers_tells_the_jump() -> None:
    run = ReplayRun(b"abcdef", 3).next()
    assert len(run.publisher_id) == 16
    assert ReplayRun.of_publisher(run.publisher_id) == run
    assert ReplayRun.of_publisher(b"x" * 16) is None
    assert ReplayRun.of_publisher(b"") is None


def test_a_recording_without_index_does_not_know_its_end_until_it_was_there(tmp_path: Path) -> None:
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(STOPPED.read_bytes()[: STOPPED.stat().st_size // 2])
    source = ReplaySource(broken)
    assert math.isnan(source.length_s)
    assert "broken off" in (list(source.from_start()) and source.problem)
    assert source.length_s > 1.0
