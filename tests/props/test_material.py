from __future__ import annotations

import numpy as np
import pytest

from bunraku.props.material import Material, TextureUse
from bunraku.props.texture import Texture

NOWHERE = np.zeros((1, 0))
WHITE = np.ones((1, 4))


def plain(*values: float) -> Texture:
    return Texture(np.array(values).reshape(1, 1, 4))


def test_look_is_the_product_of_factors_textures_and_colours_of_corners() -> None:
    material = Material(
        np.array([0.5, 0.5, 1.0, 1.0]),
        metalness=0.5,
        roughness=0.8,
        clearcoat=0.3,
        textures={
            TextureUse.BASE_COLOUR: plain(0.2, 0.4, 0.6, 0.5),
            TextureUse.METALLIC_ROUGHNESS: plain(0.9, 0.5, 0.4, 1.0),
        },
    )
    look = material.look(np.zeros((1, 4)), np.array([[1.0, 0.5, 1.0, 1.0]]))
    assert look[0] == pytest.approx([0.1, 0.1, 0.6, 0.5, 0.4, 0.2, 0.3])


def test_emission_is_added_and_nothing_exceeds_one() -> None:
    glow = Material(emission=np.array([0.5, 1.0, 0.0]))
    assert glow.look(NOWHERE, WHITE * 0.25)[0, :3] == pytest.approx([0.75, 1.0, 0.25])
    textures = {TextureUse.EMISSIVE: plain(0.5, 0.0, 1.0, 1.0)}
    masked = Material(np.zeros(4), emission=np.array([1.0, 1.0, 0.5]), textures=textures)
    assert masked.look(np.zeros((1, 2)), WHITE)[0, :3] == pytest.approx([0.5, 0.0, 0.5])
