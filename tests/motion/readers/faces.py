"""Faces that tests add to files: morph targets of glTF, expressions of VRM animations, blend shapes of FBX."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bunraku.motion.rotation import Array
from bunraku.motion.source_motion import SourceMotion
from tests.motion.readers.fbx_tree import FbxNode, ObjectName, block, leaf
from tests.motion.readers.fbx_writer import TAKE_ID, TICKS_PER_SECOND, build_curve, build_fbx
from tests.motion.readers.sources import pack_glb, unpack_glb

FACE_MODEL, FACE_MESH, FACE_DEFORMER, FACE_CHANNELS = 700_000, 700_001, 700_002, 700_100
"""Numbers of the objects of a face in FBX."""


class FaceGlb:
    """GLB file to which a face is added."""

    def __init__(self, data: bytes) -> None:
        self.document, binary = unpack_glb(data)
        self.binary = bytearray(binary)
        self.nodes: list[dict[str, Any]] = self.document["nodes"]
        self.animation: dict[str, Any] = self.document["animations"][0]

    def add_node(self, **members: Any) -> int:
        """Append a node and return its index."""
        self.nodes.append(members)
        return len(self.nodes) - 1

    def add_accessor(self, values: Array) -> int:
        """Append an accessor of values (n,) or (n, m) and return its index."""
        data = np.asarray(values, "<f4").tobytes()
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        self.document["bufferViews"].append(view)
        self.binary.extend(data)
        self.document["buffers"][0]["byteLength"] = len(self.binary)
        kind = "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}"
        accessor = {"bufferView": len(self.document["bufferViews"]) - 1, "componentType": 5126, "type": kind}
        self.document["accessors"].append(accessor | {"count": len(values)})
        return len(self.document["accessors"]) - 1

    def animate(self, node: int, path: str, times: Array, values: Array, interpolation: str = "LINEAR") -> None:
        """Append a channel of a node's property."""
        sampler = {"input": self.add_accessor(times), "output": self.add_accessor(values)}
        self.animation["samplers"].append(sampler | {"interpolation": interpolation})
        target = {"node": node, "path": path}
        self.animation["channels"].append({"sampler": len(self.animation["samplers"]) - 1, "target": target})

    def add_morphs(
        self, shapes: Mapping[str, Array], fps: float, owner: str = "mesh", interpolation: str = "LINEAR"
    ) -> int:
        """Add a mesh whose morph targets have the weights (n,) of `shapes`; return its node.

        `owner` has the names: "mesh", "primitive" or none.
        """
        names = {"extras": {"targetNames": list(shapes)}}
        primitive: dict[str, Any] = {"attributes": {}, "targets": [{}] * len(shapes)} | (
            names if owner == "primitive" else {}
        )
        meshes = self.document.setdefault("meshes", [])
        meshes.append({"primitives": [primitive]} | (names if owner == "mesh" else {}))
        node = self.add_node(name="face", mesh=len(meshes) - 1)
        weights = np.stack(list(shapes.values()), axis=1)
        times = np.arange(len(weights)) / fps
        if interpolation == "CUBICSPLINE":
            slopes = np.gradient(weights, times, axis=0)
            weights = np.stack([slopes, weights, slopes], axis=1)
        self.animate(node, "weights", times, weights.ravel(), interpolation)
        return node

    def add_expressions(
        self, presets: Mapping[str, Array], fps: float, custom: Mapping[str, Array] | None = None
    ) -> None:
        """Add the expressions of a VRM animation."""
        groups: dict[str, dict[str, Any]] = {"preset": {}, "custom": {}}
        for group, expressions in (("preset", presets), ("custom", custom or {})):
            for name, weights in expressions.items():
                node = self.add_node(name=f"expression {name}")
                groups[group][name] = {"node": node}
                places = np.stack([weights, np.zeros_like(weights), np.zeros_like(weights)], axis=1)
                self.animate(node, "translation", np.arange(len(weights)) / fps, places)
        self._vrm_animation()["expressions"] = groups

    def add_gaze(self, turns: Array, fps: float) -> None:
        """Add the gaze (n, 4) of a VRM animation, w x y z."""
        node = self.add_node(name="gaze")
        self._vrm_animation()["lookAt"] = {"node": node, "offsetFromHeadBone": [0.0, 0.06, 0.0]}
        self.animate(node, "rotation", np.arange(len(turns)) / fps, turns[:, [1, 2, 3, 0]])

    def _vrm_animation(self) -> dict[str, Any]:
        extensions = self.document.setdefault("extensions", {})
        found: dict[str, Any] = extensions.setdefault("VRMC_vrm_animation", {"specVersion": "1.0"})
        return found

    def pack(self) -> bytes:
        """Return the file."""
        return pack_glb(self.document, bytes(self.binary))


def build_face_fbx(source: SourceMotion, shapes: Mapping[str, Array], **options: Any) -> list[FbxNode]:
    """Return the tree of an FBX file of `source` with a mesh whose blend shapes have weights (n,), of one."""
    tree = build_fbx(source, **options)
    objects, links = (next(node.children for node in tree if node.name == name) for name in ("Objects", "Connections"))
    assert objects is not None
    assert links is not None
    corners = leaf("Vertices", np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]))
    mesh = block("Geometry", FACE_MESH, ObjectName("Geometry", "face"), "Mesh")
    mesh.children = [corners, leaf("PolygonVertexIndex", np.array([0, 1, -3]))]
    objects += [
        block("Model", FACE_MODEL, ObjectName("Model", "face"), "Mesh"),
        mesh,
        block("Deformer", FACE_DEFORMER, ObjectName("Deformer", "blendShape1"), "BlendShape"),
    ]
    links += [
        leaf("C", "OO", FACE_MODEL, 0),
        leaf("C", "OO", FACE_MESH, FACE_MODEL),
        leaf("C", "OO", FACE_DEFORMER, FACE_MESH),
    ]
    for place, (name, weights) in enumerate(shapes.items()):
        channel = FACE_CHANNELS + 10 * place
        percent = leaf("P", "DeformPercent", "Number", "", "A", 0.0)
        shape = block("Geometry", channel + 1, ObjectName("Geometry", name), "Shape")
        shape.children = [leaf("Indexes", np.array([0])), leaf("Vertices", np.array([0.0, 1.0, 0.0]))]
        deformer = block("Deformer", channel, ObjectName("SubDeformer", name), "BlendShapeChannel")
        deformer.children = [
            block("Properties70", children=[percent]),
            leaf("DeformPercent", 0.0),
            leaf("FullWeights", np.array([100.0])),
        ]
        times = np.round(np.arange(len(weights)) * TICKS_PER_SECOND / source.fps).astype(np.int64)
        objects += [
            deformer,
            shape,
            block("AnimationCurveNode", channel + 2, ObjectName("AnimCurveNode", "DeformPercent"), ""),
            build_curve(channel + 3, times, 100.0 * weights),
        ]
        links += [
            leaf("C", "OO", channel, FACE_DEFORMER),
            leaf("C", "OO", channel + 1, channel),
            leaf("C", "OO", channel + 2, TAKE_ID + 1),
            leaf("C", "OP", channel + 2, channel, "DeformPercent"),
            leaf("C", "OP", channel + 3, channel + 2, "d|DeformPercent"),
        ]
    return tree


def still_joints(tree: list[FbxNode]) -> list[FbxNode]:
    """Return a tree whose joints have no curves."""
    links = next(node.children for node in tree if node.name == "Connections")
    assert links is not None
    links[:] = [link for link in links if not (link.values[0] == "OP" and str(link.values[-1]).startswith("Lcl"))]
    return tree
