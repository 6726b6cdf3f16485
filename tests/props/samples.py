"""glTF assets for tests of props."""

from __future__ import annotations

import io
from typing import Any

import av
import numpy as np
import numpy.typing as npt

from tests.motion.readers.sources import pack_glb

Values = npt.NDArray[Any]
_COMPONENTS = {"f4": 5126, "u1": 5121, "u2": 5123, "u4": 5125, "i1": 5120, "i2": 5122}
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Asset:
    """A glTF asset with one scene, of which nodes are added."""

    def __init__(self) -> None:
        self.document: dict[str, Any] = {"asset": {"version": "2.0"}, "scenes": [{"nodes": []}], "nodes": []}
        self.binary = b""

    def add_view(self, data: bytes) -> int:
        """Add bytes and return the number of their view."""
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        self.binary += data + bytes(-len(data) % 4)
        return self._add("bufferViews", view)

    def add_accessor(self, values: Values, *, normalized: bool = False) -> int:
        """Add values (n, width) and return the number of their accessor."""
        rows = values.reshape(len(values), -1)
        accessor = {
            "bufferView": self.add_view(rows.tobytes()),
            "componentType": _COMPONENTS[rows.dtype.str[1:]],
            "count": len(rows),
            "type": _KINDS[rows.shape[1]],
            "normalized": normalized,
        }
        return self._add("accessors", accessor)

    def add_image(self, data: bytes, sampler: dict[str, Any] | None = None) -> int:
        """Add an image file and return the number of a texture of it."""
        texture = {"source": self._add("images", {"bufferView": self.add_view(data), "mimeType": "image/png"})}
        if sampler is not None:
            texture["sampler"] = self._add("samplers", sampler)
        return self._add("textures", texture)

    def add_material(self, **members: Any) -> int:
        """Add a material and return its number."""
        return self._add("materials", members)

    def add_mesh(
        self, positions: Values, indices: Values | None, material: int | None = None, **attributes: Values
    ) -> int:
        """Add a mesh of one surface and return its number; `attributes` by their names in glTF."""
        primitive: dict[str, Any] = {"attributes": {"POSITION": self.add_accessor(positions.astype("<f4"))}}
        for name, values in attributes.items():
            primitive["attributes"][name] = self.add_accessor(values, normalized=values.dtype.kind == "u")
        if indices is not None:
            primitive["indices"] = self.add_accessor(indices.astype("<u2").reshape(-1, 1))
        if material is not None:
            primitive["material"] = material
        return self._add("meshes", {"primitives": [primitive]})

    def add_node(self, **members: Any) -> int:
        """Add a node of the scene and return its number."""
        number = self._add("nodes", members)
        self.document["scenes"][0]["nodes"].append(number)
        return number

    def pack(self) -> bytes:
        """Return the asset as a GLB file."""
        return pack_glb({**self.document, "buffers": [{"byteLength": len(self.binary)}]}, self.binary)

    def _add(self, name: str, item: dict[str, Any]) -> int:
        items = self.document.setdefault(name, [])
        items.append(item)
        return len(items) - 1


def box(width: float, height: float, depth: float, bottom: float = 0.0) -> tuple[Values, Values]:
    """Return positions (8, 3) and triangles (12, 3) of a box around the y axis, with its base at `bottom`."""
    positions = np.array(
        [[x * width / 2, bottom + y * height, z * depth / 2] for x in (-1, 1) for y in (0, 1) for z in (-1, 1)]
    )
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return positions, np.array([[a, b, c] for a, b, c, d in quads for a, b, c in ((a, b, c), (a, c, d))])


def box_glb(width: float = 0.05, height: float = 0.6, depth: float = 0.05, bottom: float = -0.1) -> bytes:
    """Return a vermilion box as a GLB file."""
    asset = Asset()
    material = asset.add_material(
        pbrMetallicRoughness={
            "baseColorFactor": [0.45, 0.03, 0.014, 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.6,
        }
    )
    asset.add_node(mesh=asset.add_mesh(*box(width, height, depth, bottom), material))
    return asset.pack()


def image_file(pixels: Values, codec: str = "png") -> bytes:
    """Return an image file of pixels (height, width, 3), in sRGB."""
    out = io.BytesIO()
    with av.open(out, "w", format="image2pipe") as container:
        stream: Any = container.add_stream(codec, rate=1)
        stream.height, stream.width = pixels.shape[:2]
        stream.pix_fmt = {"png": "rgb24", "mjpeg": "yuvj444p", "libwebp": "yuv420p"}[codec]
        frame = av.VideoFrame.from_ndarray(pixels.astype(np.uint8), format="rgb24")
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return out.getvalue()


def picture_glb(image: bytes, sampler: dict[str, Any] | None = None, **material: Any) -> bytes:
    """Return an upright square, 1 m wide and high, with an image, as a GLB file."""
    asset = Asset()
    texture = asset.add_image(image, sampler)
    number = asset.add_material(pbrMetallicRoughness={"baseColorTexture": {"index": texture}}, **material)
    positions = np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [0.5, 1.0, 0.0], [-0.5, 1.0, 0.0]])
    coordinates = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]], dtype="<f4")
    mesh = asset.add_mesh(positions, np.array([[0, 1, 2], [0, 2, 3]]), number, TEXCOORD_0=coordinates)
    asset.add_node(mesh=mesh)
    return asset.pack()
