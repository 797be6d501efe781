"""Keys, tokens and hashes against those that rmw_zenoh's design document and ROS 2's packages publish."""

import xxhash
from zenoh import ext

from touchline.bus import attachment
from touchline.schemas import topics
from touchline.schemas.cdr import service_type_hash, type_hash, typestore
from touchline.schemas.messages import BatteryState, Imu, NavSatFix, String
from touchline.schemas.topics import Topic
from touchline.services.bridge.rmw_zenoh import RosNode, gid

STRING = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
TALKER = RosNode(2, "/", "talker", "8b20917502ee955ac4476e0266340d5c")
CHATTER = Topic("chatter", String)


def test_the_published_keys_of_a_topic():
    assert RosNode(0, "/", "talker", "z").topic_key(CHATTER) == f"0/chatter/std_msgs::msg::dds_::String_/{STRING}"
    named = RosNode(0, "/robot1", "talker", "z").topic_key(CHATTER)
    assert named == f"0/robot1/chatter/std_msgs::msg::dds_::String_/{STRING}"


def test_the_published_tokens_of_a_node_and_its_publisher():
    listener = RosNode(2, "/", "listener", "aac3178e146ba6f1fc6e6a4085e77f21")
    assert listener.token() == "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener"
    assert TALKER.publisher_token(10, CHATTER) == (
        "@ros2_lv/2/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/"
        f"{STRING}/::,10:,:,:,,"
    )


def test_a_latched_topic_of_a_robot_is_transient_local():
    node = RosNode(7, "/fleet/tt2", "touchline", "abc")
    token = node.publisher_token(3, topics.STATUS)
    assert token.startswith("@ros2_lv/7/abc/0/3/MP/%/%fleet%tt2/touchline/%fleet%tt2%traversal%status/")
    assert token.endswith("/:1:,1:,:,:,,")
    assert token.count("/") == 12


def test_a_service_has_its_own_hash_and_a_name_that_ros_allows():
    node = RosNode(0, "/tt2", "touchline", "abc")
    service = topics.diagnostics_service(topics.ROBOT_SIM)
    digest = service_type_hash("touchline_msgs/srv/GetDiagnostics")
    kind = "touchline_msgs::srv::dds_::GetDiagnostics_"
    assert node.service_key(service) == f"0/tt2/robot_sim/diagnostics/{kind}/{digest}"
    token = node.server_token(4, service)
    name = "%tt2%robot_sim%diagnostics"
    assert token == f"@ros2_lv/0/abc/0/4/SS/%/%tt2/touchline/{name}/{kind}/{digest}/::,10:,:,:,,"


def test_the_published_hashes_of_messages():
    assert type_hash(String) == STRING
    assert type_hash(Imu) == "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"
    assert type_hash(NavSatFix) == "RIHS01_62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404"
    assert type_hash(BatteryState) == "RIHS01_4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741"


def test_the_published_hash_of_a_service(monkeypatch):
    integer = typestore().fielddefs["std_msgs/msg/Int64"][1][0][1]
    fields = {"Request": ("a", "b"), "Response": ("sum",)}
    for part, names in fields.items():
        described = ([], [(name, integer) for name in names])
        monkeypatch.setitem(typestore().fielddefs, f"example_interfaces/srv/AddTwoInts_{part}", described)
    digest = service_type_hash("example_interfaces/srv/AddTwoInts")
    assert digest == "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"


def test_every_topic_and_service_has_a_key_of_its_own():
    node = RosNode(0, "/tt2", "touchline", "abc")
    keys = [node.topic_key(topic) for topic in topics.TOPICS]
    keys += [node.service_key(service) for service in topics.SERVICES]
    assert len(set(keys)) == len(topics.TOPICS) + len(topics.SERVICES)
    assert all(not set("*$?#") & set(key) and "//" not in key for key in keys)


def test_an_id_is_the_published_digest_low_half_first():
    whole = xxhash.xxh3_128_hexdigest(b"")
    assert whole == "99aa06d3014798d86001c324468d497f"  # published with the algorithm
    assert gid("") == bytes.fromhex(whole)[::-1]


def test_the_attachment_is_what_zenoh_serialises():
    number, time_ns, publisher = 3, 1_700_000_000_123_456_789, bytes(range(16))
    theirs = ext.z_serialize((ext.Int64(number), ext.Int64(time_ns), publisher)).to_bytes()
    ours = attachment.pack(number, time_ns, publisher)
    assert ours == theirs
    assert len(ours) == 33
    assert ours[16] == 16
