"""A team's algorithm in a process of its own, with Zenoh and nothing of Touchline: all robots meet.

    TOUCHLINE_ENDPOINT=tcp/127.0.0.1:7480 touchline fleet run --robots 6 --algorithm external
    python examples/teams/over_zenoh.py tcp/127.0.0.1:7480 tb1 tb2 tb3 tb4 tb5 tb6

Questions and answers are JSON in std_msgs/String (CDR: 4 bytes of header, the length with the closing zero, the text),
so another language needs a Zenoh library, and no more. One process may answer for all robots, or each for its own.
"""

import json
import struct
import sys
import time
from typing import Any

import zenoh


def packed(value: dict[str, Any]) -> bytes:
    """Pack an answer."""
    text = json.dumps(value).encode() + b"\0"
    return b"\0\1\0\0" + struct.pack("<I", len(text)) + text


def answer(asked: dict[str, Any], places: dict[str, list[float]]) -> dict[str, Any]:
    """Wish to drive to the middle of all robots heard so far, and say where this one is."""
    places |= {each["from"]: json.loads(each["text"]) for each in asked["heard"]}
    ways = [(x - asked["x_m"], y - asked["y_m"]) for x, y in places.values()] or [(0.0, 0.0)]
    wish = [0.5 * sum(way) / len(ways) for way in zip(*ways, strict=True)]
    return {"update": asked["update"], "wish": {"velocity": wish}, "say": json.dumps([asked["x_m"], asked["y_m"]])}


def main(endpoint: str, *robots: str) -> None:
    """Answer for some robots until interrupted."""
    config = zenoh.Config()
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    with zenoh.open(config) as session:
        for robot in robots:
            places: dict[str, list[float]] = {}
            publisher = session.declare_publisher(f"{robot}/algorithm/wish")

            def heard(
                sample: zenoh.Sample, publisher: zenoh.Publisher = publisher, places: dict[str, list[float]] = places
            ) -> None:
                publisher.put(packed(answer(json.loads(sample.payload.to_bytes()[8:-1]), places)))

            session.declare_subscriber(f"{robot}/algorithm/state", heard)
        while True:
            time.sleep(1.0)


if __name__ == "__main__":
    main(*sys.argv[1:])
