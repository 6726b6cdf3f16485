"""Reader of the surfaces of a glTF asset: those of its scene, at rest, in the frame of the scene."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.gltf_file import GltfFile, broken, check_index, check_objects, read_numbers
from bunraku.motion.rotation import Array
from bunraku.props.material_reader import ImageDecoder, MaterialReader
from bunraku.props.surface import Surface, Triangles

MAX_TRIANGLES = 20_000
"""Triangles that a prop may have."""
MAX_MESH_NODES = 2_000
"""Nodes with a mesh that a prop may have."""
MAX_DISTANCE = 1e6
"""Largest coordinate of a corner that is read."""
_SUPPORTED = frozenset(
    {
        *("KHR_mesh_quantization", "KHR_texture_transform", "EXT_texture_webp", "KHR_materials_unlit"),
        *("KHR_materials_clearcoat", "KHR_materials_pbrSpecularGlossiness", "KHR_materials_emissive_strength"),
        *("KHR_materials_ior", "KHR_materials_specular", "KHR_materials_sheen", "KHR_materials_transmission"),
        *("KHR_materials_volume", "KHR_materials_iridescence", "KHR_materials_anisotropy", "KHR_lights_punctual"),
        "KHR_materials_variants",
    }
)
_REMEDIES = {
    "KHR_draco_mesh_compression": "export it without compression (gltf-transform: copy decodes it)",
    "EXT_meshopt_compression": "export it without compression (gltfpack: without -c)",
    "KHR_texture_basisu": "export its images as PNG, JPEG or WebP",
}
_LIST, _STRIP, _FAN = 4, 5, 6


def read_surfaces(file: GltfFile, decode_image: ImageDecoder) -> list[Surface]:
    """Return the surfaces of the asset's scene, with both sides of open ones that are double-sided.

    Skinned meshes are in the pose of their joints, meshes with morph targets without them; points and lines are left
    out. Raises `UnreadableFile`.
    """
    _check_extensions(file)
    return _SceneReader(file, MaterialReader(file, decode_image)).read()


def _check_extensions(file: GltfFile) -> None:
    required = file.document.get("extensionsRequired", [])
    for name in required if isinstance(required, list) else []:
        if not isinstance(name, str) or name not in _SUPPORTED:
            remedy = _REMEDIES.get(str(name))
            raise UnreadableFile(
                "Unsupported extension",
                f"the file requires {str(name)[:60]}",
                field="extensionsRequired",
                hint=remedy or "export it without this extension",
            )


@dataclass(frozen=True, slots=True)
class _Primitive:
    """A surface in the frame of its mesh, and the joints that move its corners, if it is skinned."""

    surface: Surface
    joints: Triangles | None = None
    weights: Array | None = None


class _SceneReader:
    def __init__(self, file: GltfFile, materials: MaterialReader) -> None:
        self._file = file
        self._materials = materials
        self._meshes: dict[int, list[_Primitive]] = {}
        self._triangle_count = 0

    def read(self) -> list[Surface]:
        parents = self._file.find_parents()
        places = self._place_nodes(parents)
        shown = self._find_shown(parents)
        surfaces: list[Surface] = []
        nodes = [index for index in shown if "mesh" in self._file.item("nodes", index)]
        if len(nodes) > MAX_MESH_NODES:
            raise UnreadableFile("Too many parts", f"over {MAX_MESH_NODES:,} meshes", hint="join them into one")
        for index in nodes:
            item = self._file.item("nodes", index)
            mesh = self._file.check_index("meshes", item["mesh"])
            skin = self._read_skin(item["skin"], places) if "skin" in item else None
            for primitive in self._read_mesh(mesh):
                matrices = _joint_matrices(primitive, skin, f"meshes[{mesh}]")
                surface = _move(primitive.surface, places[index] if matrices is None else matrices)
                surface = surface.without_hidden().with_back()
                self._count_triangles(len(surface.triangles))
                surfaces.append(surface)
        if not any(len(surface.triangles) for surface in surfaces):
            raise UnreadableFile(
                "No surface", "the file has no triangles that can be seen", hint="export it with its meshes"
            )
        return [surface for surface in surfaces if len(surface.triangles)]

    def _count_triangles(self, count: int) -> None:
        self._triangle_count += count
        if self._triangle_count > MAX_TRIANGLES:
            raise UnreadableFile(
                "Too many triangles",
                f"a prop may have {MAX_TRIANGLES:,} triangles, both sides of sheets counted",
                hint="simplify it before the export (Blender: Decimate; gltf-transform: simplify)",
            )

    def _place_nodes(self, parents: list[int]) -> list[Array]:
        """Return the matrix (4, 4) of each node in the frame of the scene."""
        places: list[Array | None] = [None] * len(parents)
        for start in range(len(parents)):
            path, index = [], start
            while index >= 0 and places[index] is None:
                path.append(index)
                index = parents[index]
            for passed in reversed(path):
                own = _node_matrix(self._file.item("nodes", passed), passed)
                above = places[parents[passed]] if parents[passed] >= 0 else None
                places[passed] = own if above is None else above @ own
        return [place for place in places if place is not None]

    def _find_shown(self, parents: list[int]) -> list[int]:
        """Return the nodes of the scene that is shown first, in order; without scenes, all."""
        scenes = self._file.items("scenes")
        if not scenes:
            return list(range(len(parents)))
        scene = scenes[check_index(self._file.document.get("scene", 0), scenes, "scenes")]
        roots = scene.get("nodes", [])
        if not isinstance(roots, list):
            raise broken("scenes", "nodes is no list")
        waiting = [self._file.check_index("nodes", root) for root in roots]
        shown = set[int]()
        while waiting:
            index = waiting.pop()
            if index not in shown:
                shown.add(index)
                # `find_parents` has checked the children
                waiting += self._file.item("nodes", index).get("children", [])
        return sorted(shown)

    def _read_skin(self, index: object, places: list[Array]) -> Array:
        """Return the matrix (j, 4, 4) that moves what each joint of a skin moves."""
        skin, where = self._file.item("skins", index), f"skins[{index}]"
        joints = skin.get("joints")
        if not isinstance(joints, list) or not joints:
            raise broken(where, "it has no joints")
        matrices = np.array([places[self._file.check_index("nodes", joint)] for joint in joints])
        if "inverseBindMatrices" in skin:
            inverse = self._file.read_accessor(skin["inverseBindMatrices"], 16)
            if len(inverse) < len(joints) or not np.isfinite(inverse).all():
                raise broken(where, "its inverse bind matrices are too few or no numbers")
            matrices = matrices @ inverse[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
        return matrices

    def _read_mesh(self, index: int) -> list[_Primitive]:
        if index not in self._meshes:
            primitives = check_objects(
                self._file.item("meshes", index).get("primitives", []), f"meshes[{index}].primitives"
            )
            read = [
                self._read_primitive(item, f"meshes[{index}].primitives[{at}]") for at, item in enumerate(primitives)
            ]
            self._meshes[index] = [primitive for primitive in read if primitive is not None]
        return self._meshes[index]

    def _read_primitive(self, item: dict[str, Any], where: str) -> _Primitive | None:
        attributes, mode = item.get("attributes"), item.get("mode", _LIST)
        if not isinstance(attributes, dict):
            raise broken(where, "attributes is no object")
        if mode not in (_LIST, _STRIP, _FAN) or "POSITION" not in attributes:
            return None
        positions = self._file.read_accessor(attributes["POSITION"], 3)
        count = len(positions)
        if not (np.abs(positions) <= MAX_DISTANCE).all():
            raise broken(where, "a position is no number, or too far away")
        triangles = self._read_triangles(item, int(mode), count, where)
        if len(triangles) > MAX_TRIANGLES:
            self._count_triangles(len(triangles))
        material, mappings = self._materials.read(item.get("material"))

        def read(name: str, widths: tuple[int, ...]) -> Array | None:
            if name not in attributes:
                return None
            kind = self._file.item("accessors", attributes[name]).get("type")
            width = next((each for each in widths if kind == f"VEC{each}"), widths[0])
            values = self._file.read_accessor(attributes[name], width)
            if len(values) != count or not np.isfinite(values).all():
                raise broken(where, f"{name} is not {count} values")
            return values

        colours = read("COLOR_0", (4, 3))
        corners = [positions, np.zeros((count, 3)), np.ones((count, 4))]
        if colours is not None:
            corners[2][:, : colours.shape[1]] = colours
        for mapping in mappings:
            coordinates = read(f"TEXCOORD_{mapping.coordinates}", (2,))
            corners.append(np.zeros((count, 2)) if coordinates is None else mapping.apply(coordinates))
        normals = read("NORMAL", (3,))
        if normals is not None:
            corners[1] = rotation.normalise(normals)
        joints, weights = read("JOINTS_0", (4,)), read("WEIGHTS_0", (4,))
        surface = Surface(np.hstack(corners), triangles, material)
        if normals is None:
            # without normals, each face is flat
            order = triangles.reshape(-1)
            surface = replace(surface, corners=surface.corners[order], triangles=np.arange(len(order)).reshape(-1, 3))
            joints, weights = (None if each is None else each[order] for each in (joints, weights))
        if joints is None or weights is None:
            return _Primitive(surface)
        return _Primitive(surface, joints.astype(np.int64), weights)

    def _read_triangles(self, item: dict[str, Any], mode: int, count: int, where: str) -> Triangles:
        if "indices" in item:
            indices = self._file.read_accessor(item["indices"], 1)[:, 0]
            if not ((indices >= 0) & (indices < count)).all():
                raise broken(where, f"its indices are not all below {count}")
            order = indices.astype(np.int64)
        else:
            order = np.arange(count)
        if mode == _LIST:
            return order[: len(order) // 3 * 3].reshape(-1, 3)
        if mode == _FAN:
            return np.stack([order[1:-1], order[2:], np.full(max(len(order) - 2, 0), order[0])], axis=1)
        triangles = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
        triangles[1::2] = triangles[1::2][:, [1, 0, 2]]
        return triangles


def _node_matrix(item: dict[str, Any], index: int) -> Array:
    where = f"nodes[{index}]"
    if "matrix" in item:
        return read_numbers(item["matrix"], 16, where, "transform").reshape(4, 4).T
    translation, turn, scale = (
        read_numbers(item.get(name, default), len(default), where, name)
        for name, default in (("translation", [0.0] * 3), ("rotation", [0.0, 0.0, 0.0, 1.0]), ("scale", [1.0] * 3))
    )
    if not np.linalg.norm(turn) > 0.0:
        raise broken(where, "its rotation is zero")
    matrix = np.eye(4)
    matrix[:3, :3] = rotation.to_matrix(rotation.normalise(turn[[3, 0, 1, 2]])) * scale
    matrix[:3, 3] = translation
    return matrix


def _joint_matrices(primitive: _Primitive, skin: Array | None, where: str) -> Array | None:
    """Return the matrix (n, 4, 4) that moves each corner of a skinned surface; None if it is not skinned."""
    if skin is None or primitive.joints is None or primitive.weights is None:
        return None
    if not ((primitive.joints >= 0) & (primitive.joints < len(skin))).all():
        raise broken(where, f"its joints are not all below {len(skin)}")
    total = primitive.weights.sum(axis=1, keepdims=True)
    weights = primitive.weights / np.where(total > 0.0, total, 1.0)
    blended: Array = np.einsum("nk,nkij->nij", weights, skin[primitive.joints])
    return blended


def _move(surface: Surface, matrices: Array) -> Surface:
    """Return a surface moved by a matrix (4, 4), or by one for each corner (n, 4, 4)."""
    linear = matrices[..., :3, :3]
    corners = surface.corners.copy()
    corners[:, :3] = (linear @ surface.positions[:, :, None])[:, :, 0] + matrices[..., :3, 3]
    if not (np.abs(corners[:, :3]) <= MAX_DISTANCE).all():
        raise broken("nodes", "they move a surface too far away")
    # normals turn with the cofactors: the inverse transpose, up to a factor, also of matrices without an inverse
    rows = [linear[..., axis, :] for axis in range(3)]
    cofactors = np.stack([np.cross(rows[1], rows[2]), np.cross(rows[2], rows[0]), np.cross(rows[0], rows[1])], axis=-2)
    normals = (cofactors @ corners[:, 3:6, None])[:, :, 0]
    triangles = surface.triangles
    if matrices.ndim == 2 and np.linalg.det(linear) < 0.0:
        triangles = triangles[:, ::-1]
        normals = -normals
    faces = _face_normals(corners[:, :3], triangles)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    corners[:, 3:6] = np.where(lengths > 0.0, normals / np.where(lengths > 0.0, lengths, 1.0), faces)
    return replace(surface, corners=corners, triangles=triangles)


def _face_normals(positions: Array, triangles: Triangles) -> Array:
    """Return the mean normal (n, 3) of the faces at each corner, up where there is none."""
    a, b, c = (positions[triangles[:, at]] for at in range(3))
    across = np.cross(b - a, c - a)
    sums = np.zeros_like(positions)
    for at in range(3):
        np.add.at(sums, triangles[:, at], across)
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.where(lengths > 0.0, sums / np.where(lengths > 0.0, lengths, 1.0), [0.0, 1.0, 0.0])
