"""Contact sheets as PNG, without an image library."""

import struct
import zlib

import numpy as np


def write_png(path, pixels):
    """uint8 [H, W, 3] to a file."""
    height, width, _ = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in np.ascontiguousarray(pixels))

    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    )


def write_sheet(path, videos, frames=(0, 4, 8, 12, 18, 24, 30, 36), scale=2):
    """One row a video uint8 [T, H, W, 3], one column a frame."""
    sheet = np.concatenate([np.concatenate([video[frame] for frame in frames], 1) for video in videos], 0)
    write_png(path, sheet.repeat(scale, 0).repeat(scale, 1))
