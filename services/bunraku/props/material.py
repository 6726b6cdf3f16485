"""Materials of a model: what a corner of a triangle looks like."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from bunraku.motion.rotation import Array
from bunraku.props.texture import Texture

ALPHA = 3
"""Column of the opacity in the values of a look."""
LOOK_COLUMNS = 7
"""Columns of the values of a look: linear red, green and blue, opacity, roughness, metalness and clearcoat, 0..1."""


class TextureUse(StrEnum):
    """What a texture of a material determines, in the names of glTF."""

    BASE_COLOUR = "baseColorTexture"
    METALLIC_ROUGHNESS = "metallicRoughnessTexture"
    EMISSIVE = "emissiveTexture"


def _white() -> Array:
    return np.ones(4)


@dataclass(frozen=True, slots=True)
class Material:
    """A material by metalness and roughness (glTF 2.0, 3.9)."""

    base_colour: Array = field(default_factory=_white)
    """Linear red, green, blue and opacity."""
    metalness: float = 1.0
    roughness: float = 1.0
    clearcoat: float = 0.0
    emission: Array = field(default_factory=lambda: np.zeros(3))
    textures: dict[TextureUse, Texture] = field(default_factory=dict)
    """Textures, in the order of the texture coordinates of corners."""
    hidden_below: float = 0.0
    """Opacity below which nothing is seen."""
    is_double_sided: bool = False

    def look(self, coordinates: Array, colours: Array) -> Array:
        """Return the look (n, 7) of corners.

        `coordinates` (n, 2 k) has those of each of the k textures, `colours` (n, 4) the linear colours of the corners.
        """
        sampled = {
            use: texture.sample(coordinates[:, 2 * number : 2 * number + 2])
            for number, (use, texture) in enumerate(self.textures.items())
        }
        look = np.empty((len(colours), LOOK_COLUMNS))
        look[:, :4] = self.base_colour * colours
        look[:, 4:] = self.roughness, self.metalness, self.clearcoat
        if (base := sampled.get(TextureUse.BASE_COLOUR)) is not None:
            look[:, :4] *= base
        if (finish := sampled.get(TextureUse.METALLIC_ROUGHNESS)) is not None:
            look[:, 4:6] *= finish[:, 1:3]
        emission = sampled.get(TextureUse.EMISSIVE)
        look[:, :3] += self.emission if emission is None else self.emission * emission[:, :3]
        return np.clip(look, 0.0, 1.0)
