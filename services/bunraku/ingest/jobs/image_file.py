"""Decoding of the images of props: PNG, JPEG and WebP."""

from __future__ import annotations

import io

import av
import numpy as np
import numpy.typing as npt
from av.video.reformatter import Interpolation

from bunraku.motion.errors import UnreadableFile

MAX_PIXELS = 1 << 26
"""Pixels of an image that is decoded: 8,192 by 8,192."""
MAX_SIDE = 512
"""Side to which larger images are reduced: corners of triangles show no more."""
_HINT = "export it with images in PNG, JPEG or WebP"


def decode_image(data: bytes, where: str) -> npt.NDArray[np.uint8]:
    """Return the pixels (height, width, 4) of an image file, at most `MAX_SIDE` wide and high, as they are stored.

    Raises `UnreadableFile`, which names the place `where` the image is in the asset.
    """
    if data.startswith(b"\x89PNG"):
        file_format = "png_pipe"
    elif data.startswith(b"\xff\xd8\xff"):
        file_format = "jpeg_pipe"
    elif data[:4] == b"RIFF" and data[8:12] == b"WEBP":
        file_format = "webp_pipe"
    else:
        raise UnreadableFile("Unreadable image", "it is neither PNG nor JPEG nor WebP", field=where, hint=_HINT)
    try:
        with av.open(
            io.BytesIO(data), mode="r", format=file_format, options={"format_whitelist": file_format}
        ) as container:
            stream = container.streams.video[0]
            if stream.width * stream.height > MAX_PIXELS:
                detail = f"it has {stream.width} x {stream.height} pixels"
                raise UnreadableFile("Too large an image", detail, field=where, hint="export it with smaller images")
            frame = next(container.decode(stream))
        scale = min(1.0, MAX_SIDE / max(frame.width, frame.height))
        width, height = (max(1, round(side * scale)) for side in (frame.width, frame.height))
        reduced = frame.reformat(width, height, "rgba", interpolation=Interpolation.AREA)
        return np.asarray(reduced.to_ndarray(), dtype=np.uint8)
    except (av.FFmpegError, ValueError, EOFError, IndexError, StopIteration) as error:
        detail = f"it cannot be decoded: {type(error).__name__}"
        raise UnreadableFile("Unreadable image", detail, field=where, hint=_HINT) from None
