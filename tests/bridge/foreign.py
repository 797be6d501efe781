"""Recordings as other programs write them."""

from collections.abc import Iterable
from pathlib import Path

from mcap.writer import CompressionType, Writer

#: (topic, time ns, payload)
Said = Iterable[tuple[str, int, bytes]]


def foreign(
    path: Path,
    said: Said,
    *,
    encoding: str = "cdr",
    type_: str = "std_msgs/msg/String",
    schema_encoding: str = "ros2msg",
    schema: str = "string data",
    chunk_bytes: int = 1024,
    chunked: bool = True,
) -> Path:
    """An MCAP file of another recorder, all topics of one schema."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=chunk_bytes, compression=CompressionType.ZSTD, use_chunking=chunked)
        writer.start("ros2", "another recorder")
        schema_id = writer.register_schema(type_, schema_encoding, schema.encode())
        channels: dict[str, int] = {}
        for number, (topic, time_ns, payload) in enumerate(said):
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, encoding, schema_id)
            writer.add_message(channels[topic], time_ns, payload, time_ns, number)
        writer.finish()
    return path
