"""Reader of the materials of glTF assets, and of their textures."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from bunraku.motion.readers.gltf_file import GltfFile, broken, read_numbers
from bunraku.motion.rotation import Array
from bunraku.props.material import Material, TextureUse
from bunraku.props.texture import Texture, Wrap, srgb_to_linear

ImageDecoder = Callable[[bytes, str], npt.NDArray[np.uint8]]
"""Function that returns the pixels (height, width, 4) of an image file; the text says where it is in the asset."""
_NEAREST = (9728, 9984, 9986)
_BLEND_HIDDEN_BELOW = 0.1
"""Opacity below which parts of blended materials are not drawn: props are opaque."""
_IN_COLOUR = (TextureUse.BASE_COLOUR, TextureUse.EMISSIVE)


class Mapping(NamedTuple):
    """Mapping of a texture onto a surface: number of the set of coordinates, and an affine map (2, 3) of them."""

    coordinates: int
    transform: Array

    def apply(self, coordinates: Array) -> Array:
        """Return the coordinates (n, 2) in the image of those of the corners."""
        mapped: Array = coordinates @ self.transform[:, :2].T + self.transform[:, 2]
        return mapped


class MappedMaterial(NamedTuple):
    """A material, and the mapping of each of its textures."""

    material: Material
    mappings: tuple[Mapping, ...]


class MaterialReader:
    """Materials of an asset; images that several use are decoded once."""

    def __init__(self, file: GltfFile, decode_image: ImageDecoder) -> None:
        self._file = file
        self._decode_image = decode_image
        self._pixels: dict[tuple[int, bool], Array] = {}

    def read(self, index: object) -> MappedMaterial:
        """Return a material by its number, or with None that of surfaces without one: white and matt."""
        if index is None:
            return MappedMaterial(Material(metalness=0.0), ())
        item = self._file.item("materials", index)
        where = f"materials[{index}]"
        extensions = _members(item, "extensions")
        metallic, specular = (
            _members(item, "pbrMetallicRoughness"),
            _members(extensions, "KHR_materials_pbrSpecularGlossiness"),
        )
        infos: dict[TextureUse, dict[str, Any]] = {TextureUse.EMISSIVE: _members(item, "emissiveTexture")}
        emission = _numbers(item, "emissiveFactor", (0.0, 0.0, 0.0), where)
        if specular:
            colour = _numbers(specular, "diffuseFactor", (1.0,) * 4, where)
            finish = 0.0, 1.0 - _number(specular, "glossinessFactor", 1.0, where)
            infos[TextureUse.BASE_COLOUR] = _members(specular, "diffuseTexture")
        else:
            colour = _numbers(metallic, "baseColorFactor", (1.0,) * 4, where)
            # a material without these members is not metallic
            finish = (
                _number(metallic, "metallicFactor", 1.0 if metallic else 0.0, where),
                _number(metallic, "roughnessFactor", 1.0, where),
            )
            for use in (TextureUse.BASE_COLOUR, TextureUse.METALLIC_ROUGHNESS):
                infos[use] = _members(metallic, use.value)
        if "KHR_materials_unlit" in extensions:
            finish = 0.0, 1.0
        if not emission.any():
            del infos[TextureUse.EMISSIVE]
        used = {use: self._read_texture(info, use, where) for use, info in infos.items() if info}
        alpha = item.get("alphaMode")
        hidden_below = {"MASK": _number(item, "alphaCutoff", 0.5, where), "BLEND": _BLEND_HIDDEN_BELOW}
        material = Material(
            colour,
            *finish,
            _number(_members(extensions, "KHR_materials_clearcoat"), "clearcoatFactor", 0.0, where),
            emission,
            {use: texture for use, (texture, _) in used.items()},
            hidden_below.get(alpha, 0.0) if isinstance(alpha, str) else 0.0,
            item.get("doubleSided") is True,
        )
        return MappedMaterial(material, tuple(mapping for _, mapping in used.values()))

    def _read_texture(self, info: dict[str, Any], use: TextureUse, where: str) -> tuple[Texture, Mapping]:
        place = f"{where}.{use}"
        texture = self._file.item("textures", info.get("index"))
        source = _members(_members(texture, "extensions"), "EXT_texture_webp").get("source", texture.get("source"))
        if source is None:
            raise broken(place, "it has no image of a format that is read: PNG, JPEG or WebP")
        sampler = self._file.item("samplers", texture["sampler"]) if "sampler" in texture else {}
        wraps = tuple(_wrap(sampler.get(name)) for name in ("wrapS", "wrapT"))
        is_smooth = sampler.get("magFilter") not in _NEAREST
        pixels = self._read_pixels(source, use in _IN_COLOUR)
        return Texture(pixels, (wraps[0], wraps[1]), is_smooth), _read_mapping(info, place)

    def _read_pixels(self, source: object, is_colour: bool) -> Array:
        index = self._file.check_index("images", source)
        if (index, is_colour) not in self._pixels:
            decoded = self._decode_image(self._file.read_image(index), f"images[{index}]") / 255.0
            if is_colour:
                decoded[..., :3] = srgb_to_linear(decoded[..., :3])
            self._pixels[index, is_colour] = decoded
        return self._pixels[index, is_colour]


def _read_mapping(info: dict[str, Any], where: str) -> Mapping:
    """Return the mapping of a texture (KHR_texture_transform)."""
    changed = _members(_members(info, "extensions"), "KHR_texture_transform")
    number = changed.get("texCoord", info.get("texCoord", 0))
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < 8:
        raise broken(where, "texCoord is no number of coordinates")
    offset = _numbers(changed, "offset", (0.0, 0.0), where, unbounded=True)
    scale = _numbers(changed, "scale", (1.0, 1.0), where, unbounded=True)
    turn = _number(changed, "rotation", 0.0, where, unbounded=True)
    sine, cosine = math.sin(turn), math.cos(turn)
    rotated = np.array([[cosine, sine], [-sine, cosine]]) * scale
    return Mapping(number, np.column_stack([rotated, offset]))


def _wrap(value: object) -> Wrap:
    return next((each for each in Wrap if each == value), Wrap.REPEAT)


def _members(item: dict[str, Any], name: str) -> dict[str, Any]:
    """Return the object in a member, empty if there is none."""
    value = item.get(name)
    return value if isinstance(value, dict) else {}


def _number(item: dict[str, Any], name: str, default: float, where: str, *, unbounded: bool = False) -> float:
    return float(_numbers({name: [item.get(name, default)]}, name, (default,), where, unbounded=unbounded)[0])


def _numbers(
    item: dict[str, Any], name: str, default: tuple[float, ...], where: str, *, unbounded: bool = False
) -> Array:
    """Return the numbers in a member; unless `unbounded`, within 0..1."""
    values = read_numbers(item[name], len(default), where, name) if name in item else np.array(default)
    return values if unbounded else np.clip(values, 0.0, 1.0)
