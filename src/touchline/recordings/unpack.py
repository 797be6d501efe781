"""Decompression of a recording's chunks, with a limit on their size against decompression bombs."""

import zlib
from functools import cache
from io import BytesIO
from threading import get_ident
from typing import TYPE_CHECKING

from mcap.records import Chunk

from touchline.recordings.recorded import Damage

if TYPE_CHECKING:
    from zstandard import ZstdDecompressor

#: An honest chunk holds 64 KiB and the message that filled it, which has at most 32 MiB; other recorders' a few MiB.
LARGEST_CHUNK_BYTES = 64 * 1024 * 1024
_LARGEST_WINDOW_BYTES = 64 * 1024 * 1024


def unpacked(chunk: Chunk) -> bytes:
    """Unpack the records in ``chunk``.

    Raises:
        Damage: It holds too much or not what it claims, or its compression is unknown.
    """
    size = chunk.uncompressed_size
    if size > LARGEST_CHUNK_BYTES:
        raise Damage(f"a chunk of {size:,} bytes; at most {LARGEST_CHUNK_BYTES:,} are unpacked")
    try:
        body = _decompressed(chunk.compression, chunk.data, size + 1)
    except Damage:
        raise
    except Exception as error:  # each compressor raises its own errors
        raise Damage(f"a chunk that cannot be unpacked: {error}") from error
    if len(body) != size:
        raise Damage(f"a chunk that does not unpack to the {size:,} bytes that it claims")
    if chunk.uncompressed_crc and zlib.crc32(body) != chunk.uncompressed_crc:
        raise Damage("a chunk whose checksum is wrong")
    return body


def _decompressed(compression: str, data: bytes, most: int) -> bytes:
    """Unpack at most ``most`` bytes of ``data``."""
    if compression == "zstd":
        with _zstd(get_ident()).stream_reader(BytesIO(data), read_across_frames=True) as stream:
            return bytes(stream.read(most))
    if compression == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        return bytes(LZ4FrameDecompressor().decompress(data, max_length=most))
    if compression == "":
        return data
    raise Damage("a chunk of unknown compression")


@cache
def _zstd(_thread: int) -> "ZstdDecompressor":
    """Return the decompressor of a thread: making one takes longer than unpacking a chunk."""
    from zstandard import ZstdDecompressor

    return ZstdDecompressor(max_window_size=_LARGEST_WINDOW_BYTES)
