"""Clocks that were set back are told apart from messages that were overtaken, by the order of the stamps alone."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.typesys import Stores, get_typestore

from tests.imports.test_bags import fix
from touchline.checking.importing.import_logs import import_logs
from touchline.recordings.logs.formats import read_logs
from touchline.recordings.logs.time_order import in_order
from touchline.schemas.log_mapping import LogMapping

N = 1200


def stamps(rate_hz: float, back_s: float, jitter: float = 0.0, lost: float = 0.0) -> np.ndarray:
    """A stream whose clock is set back halfway; NaN-free, with jitter in periods and messages lost."""
    random = np.random.default_rng(3)
    count = max(N, int(4 * back_s * rate_hz))
    time_s = (np.arange(count) + random.normal(0.0, jitter, count)) / rate_hz
    time_s[count // 2 :] -= back_s
    return time_s[random.random(count) >= lost]


@pytest.mark.parametrize(
    ("back_s", "rate_hz", "jitter"),
    [
        *[(0.3, 5.0, 0.0), (0.3, 10.0, 0.2), (3600.0, 5.0, 0.2)],
        *product([1.0, 12.05, 59.0], [5.0, 10.0, 100.0], [0.0, 0.2]),
        pytest.param(3600.0, 100.0, 0.2, marks=pytest.mark.full),
    ],
)
def test_a_clock_set_back_by_any_step_merges_nothing(back_s, rate_hz, jitter):
    time_s = stamps(rate_hz, back_s, jitter)
    kept, told = in_order(time_s)
    half = len(time_s) // 2
    assert (kept < half).all() or (kept >= half).all()
    assert len(kept) >= half - 2
    assert any("the clock was set 1 times" in line for line in told)


def test_a_clock_set_back_amid_disorder_merges_nothing():
    overtaken = np.argsort(np.arange(N) + np.where(np.random.default_rng(1).random(N) < 0.05, 3.5, 0.0), kind="stable")
    for time_s in (
        overtaken / 10.0 - np.where(np.arange(N) < N // 2, 0.0, 12.05),
        stamps(100.0, 12.0, jitter=1.0),
        stamps(10.0, 0.7, lost=0.1),
    ):
        kept, told = in_order(time_s)
        middle = len(time_s) // 2
        assert (kept < middle + 40).all() or (kept > middle - 40).all()
        assert any("the clock was set 1 times" in line for line in told)


def test_a_clock_set_several_times_has_as_many_runs():
    time_s = np.arange(600) / 10.0
    for i in (100, 200, 300, 400):
        time_s[i:] -= 3.3
    kept, told = in_order(time_s)
    assert kept.tolist() == list(range(400, 600))
    assert told == ["the clock was set 4 times: 400 messages outside of the longest run are left out"]


@settings(max_examples=40, deadline=None)
@given(
    late=st.floats(0.0, 0.3),
    by=st.integers(1, 8),
    lost=st.floats(0.0, 0.3),
    jitter=st.floats(0.0, 0.2),
    seed=st.integers(0, 2**32 - 1),
)
def test_overtaken_and_lost_messages_are_sorted_and_none_is_left_out(late, by, lost, jitter, seed):
    random = np.random.default_rng(seed)
    order = np.argsort(
        np.arange(N) + np.where(random.random(N) < late, random.integers(1, by + 1, N), 0), kind="stable"
    )
    time_s = ((order + random.normal(0.0, jitter, N)) / 10.0)[random.random(N) >= lost]
    kept, told = in_order(time_s)
    assert (np.diff(time_s[kept]) > 0).all()
    assert len(kept) == len(time_s), told


def test_streams_that_take_turns_are_merged():
    time_s = np.arange(1000) / 10.0
    kept, told = in_order(np.column_stack([time_s, time_s - 0.35]).ravel())
    assert (len(kept), len(told)) == (2000, 1)
    backlog = np.concatenate([time_s[:400], time_s[600:610], time_s[400:600], time_s[610:]])
    assert len(in_order(backlog)[0]) == 1000


@pytest.mark.parametrize("stray_s", [1e9, 0.0, 1500.0])
def test_a_stamp_far_off_costs_its_message_alone(stray_s):
    time_s = 1000.0 + np.arange(500) / 10.0
    kept, told = in_order(np.concatenate([time_s[:200], [stray_s], time_s[200:]]))
    assert (len(kept), 200 in kept) == (500, False)
    assert told == ["1 messages have stamps far from their neighbours', and are left out"]


def test_a_table_with_the_newest_first_is_turned_round():
    kept, told = in_order(np.arange(100)[::-1] / 10.0)
    assert kept.tolist() == list(range(100))[::-1]
    assert told == ["the log has its newest message first, and was turned round"]


def test_all_streams_of_a_bag_are_cut_where_the_clock_was_set(tmp_path):
    """A ROS 1 bag, whose index sorts by time: fixes and odometry both of the run that is the longest for both."""
    types, path = get_typestore(Stores.ROS1_NOETIC), tmp_path / "drive.bag"
    with Ros1Writer(path) as writer:
        known = {}
        for i in range(600):
            true_s = i / 10.0
            time_s = true_s if i < 350 else true_s - 12.05
            told = [("/turn", types.types["std_msgs/msg/Float64"](data=true_s))]
            told += [("/fix", fix(types.types, time_s, 1e-4))] if i % 5 == 0 else []
            for topic, message in told:
                if topic not in known:
                    known[topic] = writer.add_connection(topic, message.__msgtype__, typestore=types)
                stamp_ns = round((1_700_000_000 + time_s) * 1e9)
                writer.write(known[topic], stamp_ns, types.serialize_ros1(message, message.__msgtype__))
    _, content = read_logs([path], ["/fix", "/turn"])
    assert content.tables["/turn"].columns["data"].max() == pytest.approx(34.9)
    assert len(content.tables["/fix"].time_s) == 70
    assert "the clock was set 1 times" in content.problems[0]


def test_a_reference_has_the_headings_of_its_own_run(tmp_path):
    """Straight on; the heading turns by half a turn when the clock is set back."""
    time_s = np.concatenate([np.arange(0, 300), np.arange(180, 380)]) / 10.0
    heading = np.where(np.arange(500) < 300, 0.0, math.pi / 2)
    path = tmp_path / "track.csv"
    east = np.arange(500) / 10.0
    np.savetxt(
        path,
        np.column_stack([time_s, east, 0 * east, heading]),
        "%.3f",
        ",",
        header="time_s,east_m,north_m,heading_rad",
        comments="",
    )
    mapping = LogMapping.model_validate({"fixes": {"stream": "track"}, "reference": {"stream": "track"}})
    done = import_logs([path], mapping, tmp_path / "session.mcap")
    assert done.figures["fixes"] == done.figures["reference_points"] == 300
