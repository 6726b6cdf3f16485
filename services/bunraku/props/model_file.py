"""Models of props as clients get them: core glTF 2.0 of one form (proto/playback.md, 4.12)."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bunraku.motion.rotation import Array
from bunraku.props.material import ALPHA
from bunraku.props.placing import PropForm
from bunraku.props.surface import Triangles

MEDIA_TYPE = "model/gltf-binary"
_POSITION_STEP_M = 2.0**-13
"""Positions are multiples of it, an eighth of a millimetre: their bytes then compress well."""
_NORMAL_STEP = 2.0**-7
_FLOAT, _UNSIGNED_BYTE, _UNSIGNED_SHORT = 5126, 5121, 5123
_ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 34962, 34963


@dataclass(frozen=True, slots=True)
class PropModel:
    """Mesh of a prop in its own frame: origin at the grip, y along the shaft, z to the front; metres."""

    positions: Array
    """Positions (n, 3)."""
    normals: Array
    looks: Array
    """Linear red, green, blue, opacity, roughness, metalness and clearcoat (n, 7), 0..1."""
    triangles: Triangles
    form: PropForm

    @property
    def size(self) -> list[float]:
        """Extents along x, y and z, in metres."""
        return [round(float(extent), 3) for extent in np.ptp(self.positions, axis=0)]


def weld_model(model: PropModel) -> PropModel:
    """Return a model with values rounded as in a file, equal corners once, and no triangle without an area."""
    columns = np.hstack(
        [
            np.rint(model.positions / _POSITION_STEP_M),
            np.rint(model.normals / _NORMAL_STEP),
            np.rint(model.looks * 255.0),
        ]
    ).astype(np.int64)
    # the opacity is not drawn
    columns[:, 6 + ALPHA] = 255
    kept, number = np.unique(columns, axis=0, return_inverse=True)
    triangles = number.reshape(-1)[model.triangles]
    places = kept[:, :3]
    a, b, c = (places[triangles[:, at]] for at in range(3))
    triangles = triangles[np.cross(b - a, c - a).any(axis=1)]
    # corners in the order of their use: neighbours are near one another
    used, first = np.unique(triangles.reshape(-1), return_index=True)
    order = used[np.argsort(first)]
    renamed = np.zeros(len(kept), dtype=np.int64)
    renamed[order] = np.arange(len(order))
    kept = kept[order]
    return PropModel(
        np.asarray(kept[:, :3] * _POSITION_STEP_M),
        np.asarray(kept[:, 3:6] * _NORMAL_STEP),
        kept[:, 6:] / 255.0,
        renamed[triangles],
        model.form,
    )


def write_model(model: PropModel) -> bytes:
    """Return a model of `weld_model` as a GLB file. It must have fewer than 65,536 corners."""
    looks = model.looks
    finish = np.column_stack([looks[:, 4:], np.ones(len(looks))])
    parts: list[tuple[npt.NDArray[np.generic], str, int, int]] = [
        (model.positions.astype("<f4"), "VEC3", _FLOAT, _ARRAY_BUFFER),
        (model.normals.astype("<f4"), "VEC3", _FLOAT, _ARRAY_BUFFER),
        (np.rint(looks[:, :4] * 65535.0).astype("<u2"), "VEC4", _UNSIGNED_SHORT, _ARRAY_BUFFER),
        (np.rint(finish * 255.0).astype("u1"), "VEC4", _UNSIGNED_BYTE, _ARRAY_BUFFER),
        (model.triangles.reshape(-1).astype("<u2"), "SCALAR", _UNSIGNED_SHORT, _ELEMENT_ARRAY_BUFFER),
    ]
    binary = bytearray()
    views: list[dict[str, object]] = []
    accessors: list[dict[str, object]] = []
    for number, (values, kind, component, target) in enumerate(parts):
        data = values.tobytes()
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data), "target": target})
        accessor = {"bufferView": number, "componentType": component, "count": len(values), "type": kind}
        if component != _FLOAT and target == _ARRAY_BUFFER:
            accessor["normalized"] = True
        if number == 0:
            accessor |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        accessors.append(accessor)
        binary += data + bytes(-len(data) % 4)
    form = model.form
    document = {
        "asset": {"version": "2.0", "generator": "Bunraku"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "extras": {"pitch": form.pitch, "height": form.height, "palmOffset": form.palm_offset}}],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2, "_FINISH": 3},
                        "indices": 4,
                        "mode": 4,
                        "material": 0,
                    }
                ]
            }
        ],
        "materials": [
            {
                "pbrMetallicRoughness": {
                    "roughnessFactor": round(float(looks[:, 4].mean()), 3),
                    "metallicFactor": round(float(looks[:, 5].mean()), 3),
                }
            }
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
