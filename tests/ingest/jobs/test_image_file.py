from __future__ import annotations

import numpy as np
import pytest

from bunraku.ingest.jobs import image_file as module
from bunraku.ingest.jobs.image_file import MAX_SIDE, decode_image
from bunraku.motion.errors import UnreadableFile
from tests.props.samples import image_file

HALVES = np.zeros((40, 60, 3), dtype=np.uint8)
HALVES[:20] = (250, 120, 10)


@pytest.mark.parametrize(("codec", "tolerance"), [("png", 0), ("mjpeg", 8), ("libwebp", 12)])
def test_images_are_decoded_with_their_colours(codec: str, tolerance: int) -> None:
    pixels = decode_image(image_file(HALVES, codec), "images[0]")
    assert pixels.shape == (40, 60, 4)
    assert (pixels[..., 3] == 255).all()
    difference = np.abs(pixels[..., :3].astype(int) - HALVES)
    # the border between the halves is blurred by lossy formats
    assert np.delete(difference, range(16, 24), axis=0).max() <= tolerance


def test_large_image_is_reduced_in_proportion() -> None:
    wide = np.zeros((256, 2048, 3), dtype=np.uint8)
    wide[:, 1024:] = 255
    pixels = decode_image(image_file(wide), "images[0]")
    assert pixels.shape == (MAX_SIDE // 8, MAX_SIDE, 4)
    assert (pixels[:, 0, 0] == 0).all()
    assert (pixels[:, -1, 0] == 255).all()


def test_image_with_too_many_pixels_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_PIXELS", 2_000)
    with pytest.raises(UnreadableFile, match="60 x 40 pixels") as raised:
        decode_image(image_file(HALVES), "images[3]")
    assert raised.value.field == "images[3]"


@pytest.mark.parametrize(
    "data", [b"", b"GIF89a", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"RIFF\0\0\0\0WEBP", image_file(HALVES)[:60]]
)
def test_broken_and_other_images_are_refused(data: bytes) -> None:
    with pytest.raises(UnreadableFile, match="Unreadable image") as raised:
        decode_image(data, "images[1]")
    assert raised.value.field == "images[1]"
    assert "PNG, JPEG or WebP" in raised.value.hint
