"""MCAP files whose types are defined in IDL, as rosbag2 writes those that have no .msg file."""

import numpy as np
import pytest
from mcap.writer import Writer
from rosbags.typesys import Stores, get_typestore

from tests.imports.test_bags import fix
from touchline.recordings.logs.formats import read_logs

FILES = {
    "sensor_msgs/msg/NavSatFix": """// generated from rosidl_adapter/resource/msg.idl.em
#include "sensor_msgs/msg/NavSatStatus.idl"
#include "std_msgs/msg/Header.idl"
module sensor_msgs { module msg {
  typedef double double__9[9];
  module NavSatFix_Constants { const uint8 COVARIANCE_TYPE_UNKNOWN = 0; };
  @verbatim (language="comment", text="Navigation Satellite fix" "\\n" "for any GNSS")
  struct NavSatFix {
    @verbatim (language="comment", text="header.stamp")
    std_msgs::msg::Header header;
    sensor_msgs::msg::NavSatStatus status;
    @unit (value="degrees")
    double latitude; double longitude; double altitude;
    double__9 position_covariance;
    uint8 position_covariance_type;
  };
}; };
""",
    "sensor_msgs/msg/NavSatStatus": "module sensor_msgs { module msg { struct NavSatStatus { int8 status; "
    "uint16 service; }; }; };\n",
    "std_msgs/msg/Header": '#include "builtin_interfaces/msg/Time.idl"\nmodule std_msgs { module msg { struct Header { '
    "builtin_interfaces::msg::Time stamp; string frame_id; }; }; };\n",
    "builtin_interfaces/msg/Time": "module builtin_interfaces { module msg { struct Time { int32 sec; "
    "uint32 nanosec; }; }; };\n",
}


@pytest.mark.parametrize("encoding", ["ros2idl", "omgidl"])
def test_topics_of_types_in_idl_are_read(tmp_path, encoding):
    types, path = get_typestore(Stores.ROS2_JAZZY), tmp_path / "drive.mcap"
    text = "".join(f"{'=' * 80}\nIDL: {name}\n{definition}" for name, definition in FILES.items())
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        schema = writer.register_schema("sensor_msgs/msg/NavSatFix", encoding, text.encode())
        channel = writer.register_channel("/fix", "cdr", schema)
        for i in range(5):
            message = fix(types.types, float(i), 1e-4)
            writer.add_message(channel, i, bytes(types.serialize_cdr(message, message.__msgtype__)), i)
        writer.finish()
    (_, content) = read_logs([path])
    table = content.tables["/fix"]
    assert np.diff(table.time_s).tolist() == [1.0] * 4
    assert table.columns["latitude"].tolist() == [48.12] * 5
    assert table.columns["fix"].tolist() == [3.0] * 5
