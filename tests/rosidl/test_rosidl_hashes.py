"""Our type hashes against those of ROS 2's own code generator (`make ros2-hashes` writes them)."""

import json
from pathlib import Path

import pytest

from touchline.schemas import topics
from touchline.schemas.cdr import service_type_hash, typestore
from touchline.schemas.definition_folder import used_types

GOLDEN = json.loads((Path(__file__).parent / "rosidl_hashes.json").read_text(encoding="utf-8"))["hashes"]
SERVICES = {name.removesuffix("_Request") for name in GOLDEN if name.endswith("_Request")}
MESSAGES = GOLDEN.keys() - SERVICES


def test_rosidl_has_hashed_every_type_that_we_use() -> None:
    used = used_types()
    named = {name.removesuffix("_Request") for name in used if name.endswith("_Request")}
    assert named >= {service.ros_type for service in (*topics.SERVICES, *topics.PARAMETER_SERVICES)}
    assert GOLDEN.keys() == used | named, "run make ros2-hashes"


@pytest.mark.parametrize("name", sorted(MESSAGES))
def test_a_messages_hash_is_rosidls(name: str) -> None:
    assert typestore().hash_rihs01(name) == GOLDEN[name]


@pytest.mark.parametrize("name", sorted(SERVICES))
def test_a_services_hash_is_rosidls(name: str) -> None:
    assert service_type_hash(name) == GOLDEN[name]
