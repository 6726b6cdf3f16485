from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.gltf_file import parse_gltf_file
from bunraku.props.material import TextureUse
from bunraku.props.material_reader import MappedMaterial, MaterialReader
from bunraku.props.texture import Wrap
from tests.props.samples import Asset

GREY = np.full((2, 2, 4), 128, dtype=np.uint8)


def read(asset: Asset, number: int | None = 0, decoded: list[str] | None = None) -> MappedMaterial:
    def decode(_: bytes, where: str) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
        if decoded is not None:
            decoded.append(where)
        return GREY

    return MaterialReader(parse_gltf_file(asset.pack()), decode).read(number)


def of(**members: Any) -> MappedMaterial:
    asset = Asset()
    asset.add_material(**members)
    return read(asset)


def test_surface_without_material_is_white_and_matt() -> None:
    material, mappings = read(Asset(), None)
    assert (material.base_colour.tolist(), material.metalness, material.roughness) == ([1.0] * 4, 0.0, 1.0)
    assert mappings == ()
    assert of(name="bare").material.metalness == 0.0
    assert of(pbrMetallicRoughness={"roughnessFactor": 0.5}).material.metalness == 1.0


def test_factors_are_read_and_kept_within_their_range() -> None:
    material = of(
        pbrMetallicRoughness={"baseColorFactor": [0.1, 0.2, 0.3, 2.0], "metallicFactor": -1, "roughnessFactor": 0.4},
        emissiveFactor=[0.5, 0.0, 0.0],
        alphaMode="MASK",
        alphaCutoff=0.25,
        doubleSided=True,
        extensions={"KHR_materials_clearcoat": {"clearcoatFactor": 0.75}},
    ).material
    assert material.base_colour.tolist() == [0.1, 0.2, 0.3, 1.0]
    assert (material.metalness, material.roughness, material.clearcoat) == (0.0, 0.4, 0.75)
    assert (material.emission.tolist(), material.hidden_below) == ([0.5, 0.0, 0.0], 0.25)
    assert material.is_double_sided
    assert of(alphaMode="BLEND").material.hidden_below == 0.1


def test_older_and_unlit_materials_are_read() -> None:
    older = {"diffuseFactor": [0.5, 0.5, 0.5, 1.0], "glossinessFactor": 0.75}
    material = of(extensions={"KHR_materials_pbrSpecularGlossiness": older}).material
    assert (material.base_colour[0], material.roughness, material.metalness) == (0.5, 0.25, 0.0)
    unlit = of(pbrMetallicRoughness={"metallicFactor": 1.0}, extensions={"KHR_materials_unlit": {}}).material
    assert (unlit.metalness, unlit.roughness) == (0.0, 1.0)


def test_textures_have_their_mapping_and_sampling_and_are_decoded_once() -> None:
    asset, decoded = Asset(), list[str]()
    texture = asset.add_image(b"image", {"wrapS": 33071, "wrapT": 33648, "magFilter": 9728})
    moved = {"offset": [0.5, 0.25], "scale": [2.0, 4.0], "rotation": np.pi / 2, "texCoord": 1}
    info = {"index": texture, "extensions": {"KHR_texture_transform": moved}}
    asset.add_material(
        pbrMetallicRoughness={"baseColorTexture": info, "metallicRoughnessTexture": {"index": texture}},
        emissiveTexture={"index": texture},
    )
    material, mappings = read(asset, 0, decoded)
    assert list(material.textures) == [TextureUse.BASE_COLOUR, TextureUse.METALLIC_ROUGHNESS]
    base = material.textures[TextureUse.BASE_COLOUR]
    assert (base.wraps, base.is_smooth) == ((Wrap.CLAMP, Wrap.MIRROR), False)
    # colours are linear, other values as they are
    assert base.pixels[0, 0] == pytest.approx([0.2159, 0.2159, 0.2159, 128 / 255], abs=1e-4)
    assert material.textures[TextureUse.METALLIC_ROUGHNESS].pixels[0, 0] == pytest.approx(128 / 255)
    assert [mapping.coordinates for mapping in mappings] == [1, 0]
    # scaled, turned, moved (KHR_texture_transform, overview)
    assert mappings[0].apply(np.array([[1.0, 0.0], [0.0, 1.0]])) == pytest.approx(np.array([[0.5, -1.75], [4.5, 0.25]]))
    assert decoded == ["images[0]", "images[0]"]


@pytest.mark.parametrize(
    ("members", "message"),
    [
        ({"pbrMetallicRoughness": {"baseColorFactor": [1, 1]}}, r"baseColorFactor is not 4 numbers"),
        ({"pbrMetallicRoughness": {"roughnessFactor": "x"}}, r"roughnessFactor is not 1 numbers"),
        ({"pbrMetallicRoughness": {"baseColorTexture": {"index": 7}}}, "there is no number '7'"),
        ({"pbrMetallicRoughness": {"baseColorTexture": {}, "metallicRoughnessTexture": {"index": None}}}, "no number"),
        ({"alphaMode": "MASK", "alphaCutoff": []}, "alphaCutoff is not 1 numbers"),
        ({"emissiveFactor": {"r": 1}}, "emissiveFactor is not 3 numbers"),
    ],
)
def test_broken_material_is_refused_with_its_place(members: dict[str, Any], message: str) -> None:
    with pytest.raises(UnreadableFile, match=message) as raised:
        of(**members)
    assert raised.value.field
