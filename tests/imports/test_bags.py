"""Bags of ROS 1 and 2 with the difficulties of real ones, written with rosbags."""

import math

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from touchline.checking.estimating.estimate_figures import estimate_figures
from touchline.checking.estimating.estimator_run import run_estimator
from touchline.checking.estimating.reference_frame import FrameFit
from touchline.checking.importing.import_logs import import_logs
from touchline.checking.importing.mapping_proposal import proposal
from touchline.recordings.logs.formats import open_log
from touchline.schemas.errors import SpecError
from touchline.schemas.log_mapping import LogMapping

BEGIN_S = 1_700_000_000


def header(types, time_s):
    stamp = types["builtin_interfaces/msg/Time"](int(time_s), round(time_s % 1.0 * 1e9))
    known = {"seq": 0} if "seq" in types["std_msgs/msg/Header"].__dataclass_fields__ else {}
    return types["std_msgs/msg/Header"](stamp=stamp, frame_id="gps", **known)


def fix(types, time_s, variance_m2, status=2):
    east_deg = 1e-6 * math.sin(time_s)
    covariance = np.zeros(9)
    covariance[[0, 4, 8]] = variance_m2
    return types["sensor_msgs/msg/NavSatFix"](
        header=header(types, BEGIN_S + time_s),
        status=types["sensor_msgs/msg/NavSatStatus"](status=status, service=1),
        latitude=48.12,
        longitude=11.52 + east_deg,
        altitude=500.0,
        position_covariance=covariance,
        position_covariance_type=2,
    )


def messages(types):
    """(time it came, topic, message): a receiver alone, with all that receivers' drivers do, and words."""
    text = types["std_msgs/msg/String"]
    told = [(0.0, "/chatter", text(data="hello"))]
    for i in range(60):
        if 20 <= i < 30:  # a gap
            continue
        time_s = i - 0.5 if i == 40 else float(i)  # one that is older than the one before
        variance_m2 = math.nan if i < 3 else 0.0 if i < 5 else 1e-4
        told.append((i + 0.05, "/fix", fix(types, time_s - (0.7 if i == 40 else 0.0), variance_m2)))
        if i == 50:
            told.append((i + 0.06, "/fix", fix(types, time_s, 1e-4)))  # sent twice
    told.append((60.05, "/fix", fix(types, 60.0, 1e-4, status=-1)))
    return told


def ros1(folder):
    types, path = get_typestore(Stores.ROS1_NOETIC), folder / "drive.bag"
    with Ros1Writer(path) as writer:
        write(writer, types, types.serialize_ros1)
    return path


def ros2(folder, plugin):
    types, path = get_typestore(Stores.ROS2_JAZZY), folder / plugin.name.lower()
    with Ros2Writer(path, version=9, storage_plugin=plugin) as writer:
        write(writer, types, types.serialize_cdr)
    return path


def write(writer, types, serialize):
    said = {}
    for time_s, topic, message in messages(types.types):
        if topic not in said:
            said[topic] = writer.add_connection(topic, message.__msgtype__, typestore=types)
        writer.write(said[topic], round((BEGIN_S + time_s) * 1e9), serialize(message, message.__msgtype__))


@pytest.fixture(params=["ros1", "sqlite3", "mcap"])
def bag(request, tmp_path):
    if request.param == "ros1":
        return ros1(tmp_path)
    return ros2(tmp_path, StoragePlugin[request.param.upper()])


def test_a_receiver_alone_becomes_a_session_and_its_difficulties_are_told(bag, tmp_path):
    log, out = open_log(bag), tmp_path / "session.mcap"
    listed = {stream.name: stream for stream in log.streams()}
    assert listed["/chatter"].messages == 1
    assert (listed["/fix"].kind, listed["/fix"].messages) == ("sensor_msgs/msg/NavSatFix", 52)
    words_alone = log.read(["/chatter"]).tables["/chatter"]
    assert (len(words_alone.time_s), dict(words_alone.columns)) == (1, {})
    proposed = proposal([bag])
    assert proposed.fixes.stream == "/fix"
    done = import_logs([bag], proposed, out)
    told = "\n".join(done.remarks)
    for words in ("5 report no σ", "1 messages are older than the one before", "1 messages repeat a stamp"):
        assert words in told
    assert "1 of 51 have no position" in told
    assert "no odometry" in told or "cannot start" in told
    assert done.figures["fixes"] == 51
    assert done.figures["fixed_pct"] == pytest.approx(100.0 * 45 / 51)
    if bag.suffix == ".bag":  # what is imported is the same
        figures = estimate_figures(run_estimator(out), FrameFit.NONE)
        assert len(figures["verdict"]) == 1
        assert "the log has no wheels" in figures["verdict"][0]


def test_a_stream_of_words_has_nothing_for_a_sensor(tmp_path):
    mapping = LogMapping.model_validate({"fixes": {"stream": "/chatter"}})
    with pytest.raises(SpecError, match=r"fixes\.columns do not name the column of /chatter for latitude_deg"):
        import_logs([ros1(tmp_path)], mapping, tmp_path / "session.mcap")
