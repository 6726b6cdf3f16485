"""Reader of props: from a glTF asset to the model that clients draw."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.gltf_file import parse_gltf_file
from bunraku.props.detail import refine
from bunraku.props.material_reader import ImageDecoder
from bunraku.props.model_file import PropModel, weld_model
from bunraku.props.placing import Grip, find_form, place_prop
from bunraku.props.scene_reader import read_surfaces
from bunraku.props.surface import Surface

DETAIL_TRIANGLES = 8_000
"""Triangles of a prop up to which those whose texture varies are divided."""
SHORTEST_EDGE = 1 / 160
"""Length of the shortest edge that is divided, as a share of the prop's length."""


class ReadProp(NamedTuple):
    """A model, and the guesses about it."""

    model: PropModel
    guessed: list[str]


def read_prop(
    data: bytes, decode_image: ImageDecoder, length: float | None = None, grip: Grip | None = None
) -> ReadProp:
    """Return the model of a glTF asset, made `length` metres long and held at `grip` if they are given.

    Textures become colours of the corners, whose triangles are divided where the texture varies. Raises
    `UnreadableFile`.
    """
    surfaces = _refine(read_surfaces(parse_gltf_file(data), decode_image))
    corners = np.cumsum([0, *(len(surface.corners) for surface in surfaces)])
    positions = np.vstack([surface.positions for surface in surfaces])
    triangles = np.vstack([surface.triangles + first for surface, first in zip(surfaces, corners, strict=False)])
    # corners that no triangle has do not count
    placing = place_prop(positions[np.unique(triangles)], length, grip)
    placed = np.zeros_like(positions)
    placed[np.unique(triangles)] = placing.positions
    model = weld_model(
        PropModel(
            placed,
            np.vstack([surface.normals for surface in surfaces]),
            np.vstack([surface.look_at(surface.corners) for surface in surfaces]),
            triangles,
            find_form(placed, triangles),
        )
    )
    if not len(model.triangles):
        raise UnreadableFile("No surface", "its triangles have no area", hint="export it with its meshes")
    return ReadProp(model, placing.guessed)


def _refine(surfaces: list[Surface]) -> list[Surface]:
    """Divide the triangles with textures; surfaces get room for it by their area."""
    room = DETAIL_TRIANGLES - sum(len(surface.triangles) for surface in surfaces)
    if room <= 0:
        return surfaces
    areas = [_area(surface) if surface.material.textures else 0.0 for surface in surfaces]
    total = sum(areas)
    used = np.vstack([surface.positions[surface.triangles.reshape(-1)] for surface in surfaces])
    shortest = SHORTEST_EDGE * float(np.ptp(used, axis=0).max())
    return [
        refine(surface, shortest, len(surface.triangles) + int(room * area / total)) if area > 0.0 else surface
        for surface, area in zip(surfaces, areas, strict=True)
    ]


def _area(surface: Surface) -> float:
    a, b, c = (surface.positions[surface.triangles[:, at]] for at in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
