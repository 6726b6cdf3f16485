"""Textures of a model, sampled at the corners of its triangles."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from bunraku.motion.rotation import Array


class Wrap(IntEnum):
    """Continuation of an image beyond its border (glTF 2.0, 5.26: wrapS)."""

    CLAMP = 33071
    MIRROR = 33648
    REPEAT = 10497


@dataclass(frozen=True, slots=True)
class Texture:
    """An image, and how it is sampled."""

    pixels: Array
    """Values (height, width, 4), 0..1, the first row at v = 0."""
    wraps: tuple[Wrap, Wrap] = (Wrap.REPEAT, Wrap.REPEAT)
    is_smooth: bool = True
    """True if values between the centres of pixels are interpolated."""

    def sample(self, coordinates: Array) -> Array:
        """Return the values (n, 4) at texture coordinates (n, 2)."""
        size = np.array(self.pixels.shape[1::-1])
        at = coordinates * size - 0.5
        # at the border of the image, the other side does not shine through: a corner's colour is seen far from it
        is_inside = (coordinates >= 0.0) & (coordinates <= 1.0)
        at = np.where(is_inside, np.clip(at, 0.0, size - 1.0), at)
        if not self.is_smooth:
            return self._pick(np.rint(at))
        below = np.floor(at)
        x, y = ((at - below)[:, [axis]] for axis in (0, 1))
        upper, lower = (
            self._pick(below + np.array([0, row])) * (1.0 - x) + self._pick(below + np.array([1, row])) * x
            for row in (0, 1)
        )
        sampled: Array = upper * (1.0 - y) + lower * y
        return sampled

    def _pick(self, places: Array) -> Array:
        """Return the values of pixels (n, 2) that may lie beyond the border."""
        height, width = self.pixels.shape[:2]
        columns, rows = (_wrap(places[:, axis], size, self.wraps[axis]) for axis, size in ((0, width), (1, height)))
        return self.pixels[rows, columns]


def srgb_to_linear(values: Array) -> Array:
    """Return linear light of values in the transfer function of sRGB (IEC 61966-2-1), 0..1."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(values: Array) -> Array:
    """Return values in the transfer function of sRGB of linear light, 0..1."""
    return np.where(values <= 0.0031308, values * 12.92, 1.055 * np.maximum(values, 0.0) ** (1 / 2.4) - 0.055)


def _wrap(places: Array, size: int, wrap: Wrap) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    if wrap is Wrap.CLAMP:
        places = np.clip(places, 0, size - 1)
    elif wrap is Wrap.MIRROR:
        places = np.mod(places, 2 * size)
        places = np.minimum(places, 2 * size - 1 - places)
    else:
        places = np.mod(places, size)
    return np.clip(places, 0, size - 1).astype(np.int64)
