from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.gltf_file import parse_gltf_file
from bunraku.props import scene_reader
from bunraku.props.scene_reader import read_surfaces
from bunraku.props.surface import Surface
from tests.props.samples import Asset, box, box_glb


def no_images(_: bytes, _where: str) -> Any:
    return np.zeros((1, 1, 4), dtype=np.uint8)


def surfaces(asset: Asset) -> list[Surface]:
    return read_surfaces(parse_gltf_file(asset.pack()), no_images)


def boxes(*nodes: dict[str, Any]) -> Asset:
    """Return an asset of boxes with these members of nodes."""
    asset = Asset()
    asset.add_mesh(*box(1.0, 1.0, 1.0))
    for node in nodes:
        asset.add_node(mesh=0, **node)
    return asset


def outward(surface: Surface) -> bool:
    """Return whether all faces of a convex surface look away from its middle, and its normals with them."""
    a, b, c = (surface.positions[surface.triangles[:, at]] for at in range(3))
    face = np.cross(b - a, c - a)
    middle = surface.positions.mean(axis=0)
    normals = surface.corners[surface.triangles[:, 0], 3:6]
    return bool(
        (np.einsum("ij,ij->i", face, a - middle) > 0.0).all() and (np.einsum("ij,ij->i", face, normals) > 0).all()
    )


@pytest.mark.parametrize(
    "node",
    [
        {},
        {"translation": [1, 2, 3], "rotation": [0, 0.6, 0, 0.8], "scale": [1, 2, 3]},
        {"scale": [-1, 1, 1]},
        {"matrix": [0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]},
    ],
)
def test_surfaces_are_placed_and_look_outward(node: dict[str, Any]) -> None:
    (surface,) = surfaces(boxes(node))
    assert outward(surface)
    if "translation" in node:
        assert surface.positions.min(axis=0) == pytest.approx([1 - 0.14 - 1.44, 2.0, 3 - 0.42 - 0.48])
    if "matrix" in node:
        assert surface.positions.min(axis=0) == pytest.approx([5.0, 5.5, 6.5])


def test_transforms_of_ancestors_are_applied_and_only_the_shown_scene_is_read() -> None:
    asset = boxes()
    asset.document["nodes"] = [
        {"translation": [0, 10, 0], "children": [1]},
        {"scale": [2, 2, 2], "children": [2]},
        {"mesh": 0},
        {"mesh": 0},
    ]
    asset.document |= {"scenes": [{"nodes": [3]}, {"nodes": [0]}], "scene": 1}
    (surface,) = surfaces(asset)
    assert surface.positions[:, 1].min() == pytest.approx(10.0)
    assert np.ptp(surface.positions[:, 0]) == pytest.approx(2.0)
    del asset.document["scenes"]
    assert len(surfaces(asset)) == 2


@pytest.mark.parametrize(
    ("mode", "indices", "expected"),
    [
        (4, None, [[0, 1, 2]]),
        (4, [0, 1, 2, 0, 2, 3], [[0, 1, 2], [0, 2, 3]]),
        (5, [0, 1, 2, 3], [[0, 1, 2], [2, 1, 3]]),
        (6, [0, 1, 2, 3], [[1, 2, 0], [2, 3, 0]]),
    ],
)
def test_lists_strips_and_fans_of_triangles_are_read(
    mode: int, indices: list[int] | None, expected: list[list[int]]
) -> None:
    asset = Asset()
    positions = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    normals = np.tile(np.array([0, 0, 1], dtype="<f4"), (4, 1))
    asset.add_node(mesh=asset.add_mesh(positions, None if indices is None else np.array(indices), NORMAL=normals))
    asset.document["meshes"][0]["primitives"][0]["mode"] = mode
    (surface,) = surfaces(asset)
    assert surface.triangles.tolist() == expected


def test_points_and_lines_are_left_out() -> None:
    asset = boxes({})
    asset.document["meshes"][0]["primitives"] += [{"mode": 1, "attributes": {"POSITION": 0}}]
    assert len(surfaces(asset)) == 1
    asset.document["meshes"][0]["primitives"][0]["mode"] = 0
    with pytest.raises(UnreadableFile, match="no triangles that can be seen"):
        surfaces(asset)


def test_quantized_positions_and_colours_of_corners_are_read() -> None:
    asset = Asset()
    positions, triangles = box(2.0, 2.0, 2.0, -1.0)
    mesh = asset.add_mesh(positions, triangles, COLOR_0=np.tile(np.array([255, 0, 51], dtype="u1"), (8, 1)))
    quantized = asset.add_accessor((positions * 127).astype("i1"), normalized=True)
    asset.document["meshes"][mesh]["primitives"][0]["attributes"]["POSITION"] = quantized
    asset.document["extensionsRequired"] = ["KHR_mesh_quantization"]
    asset.add_node(mesh=mesh)
    (surface,) = surfaces(asset)
    assert np.abs(surface.positions).max(axis=0) == pytest.approx([1.0] * 3)
    assert surface.look_at(surface.corners)[:, :3] == pytest.approx(np.tile([1.0, 0.0, 0.2], (36, 1)))


def test_skinned_surface_is_in_the_pose_of_its_joints() -> None:
    asset = Asset()
    positions, triangles = box(1.0, 2.0, 1.0)
    upper = (positions[:, 1] > 1.0).astype("u1")
    joints = np.column_stack([upper, np.zeros((8, 3), "u1")]).astype("u1")
    weights = np.tile(np.array([1.0, 0.0, 0.0, 0.0], dtype="<f4"), (8, 1))
    mesh = asset.add_mesh(positions, triangles, WEIGHTS_0=weights)
    asset.document["meshes"][mesh]["primitives"][0]["attributes"]["JOINTS_0"] = asset.add_accessor(joints)
    asset.add_node()
    asset.add_node(translation=[0, 5, 0])
    asset.document["skins"] = [{"joints": [0, 1]}]
    # the place of a skinned node itself does not count
    asset.add_node(mesh=mesh, skin=0, translation=[100, 0, 0])
    (surface,) = surfaces(asset)
    assert surface.positions.min(axis=0) == pytest.approx([-0.5, 0.0, -0.5])
    assert surface.positions[:, 1].max() == pytest.approx(7.0)
    asset.document["skins"][0]["joints"] = [0]
    with pytest.raises(UnreadableFile, match="joints are not all below 1"):
        surfaces(asset)


def test_too_many_triangles_are_refused_before_they_take_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scene_reader, "MAX_TRIANGLES", 30)
    assert len(surfaces(boxes({}, {"translation": [2, 0, 0]}))) == 2
    with pytest.raises(UnreadableFile, match="a prop may have 30 triangles"):
        surfaces(boxes({}, {}, {}))


def test_thousands_of_nodes_are_refused() -> None:
    with pytest.raises(UnreadableFile, match="over 2,000 meshes"):
        surfaces(boxes(*[{"scale": [0, 0, 0]}] * 2_001))


def test_deep_hierarchy_is_read() -> None:
    asset = boxes()
    asset.document["nodes"] = [{"children": [at + 1]} for at in range(5_000)] + [{"mesh": 0}]
    asset.document["scenes"] = [{"nodes": [0]}]
    assert len(surfaces(asset)) == 1


def broken(change: Callable[[dict[str, Any]], object]) -> Asset:
    asset = boxes({})
    change(asset.document)
    return asset


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.update(extensionsRequired=["KHR_draco_mesh_compression"]), "requires KHR_draco_mesh_compression"),
        (lambda d: d.update(extensionsRequired=["KHR_texture_basisu"]), "requires KHR_texture_basisu"),
        (lambda d: d.update(extensionsRequired=[{}]), "Unsupported extension"),
        (lambda d: d.update(scenes=[{"nodes": [9]}]), "there is no number '9'"),
        (lambda d: d.update(scenes=[{"nodes": {}}]), "nodes is no list"),
        (lambda d: d.update(scene=3), "there is no number '3'"),
        (lambda d: d["nodes"][0].update(children=[0]), "it lies inside itself"),
        (lambda d: d["nodes"][0].update(scale=[1, 2]), "its scale is not 3 numbers"),
        (lambda d: d["nodes"][0].update(scale=[1e29, 1, 1]), "too far away"),
        (lambda d: d["nodes"][0].update(rotation=[0, 0, 0, 0]), "its rotation is zero"),
        (lambda d: d["nodes"][0].update(skin=0), "there is no number '0'"),
        (lambda d: d["nodes"][0].update(mesh="x"), "there is no number 'x'"),
        (lambda d: d["meshes"][0].update(primitives=3), "it is no list of objects"),
        (lambda d: d["meshes"][0]["primitives"][0].update(attributes=[]), "attributes is no object"),
        (lambda d: d["meshes"][0]["primitives"][0]["attributes"].update(NORMAL=1), "it has no elements of 3 numbers"),
        (lambda d: d["meshes"][0]["primitives"][0].update(indices=0), "it has no elements of 1 number"),
        (lambda d: d["accessors"][0].update(count=3), "its indices are not all below 3"),
        (lambda d: d["accessors"][0].update(count=10**9), "count is"),
    ],
)
def test_broken_asset_is_refused_with_its_place(change: Callable[[dict[str, Any]], object], message: str) -> None:
    with pytest.raises(UnreadableFile, match=message) as raised:
        surfaces(broken(change))
    assert raised.value.field


def test_plain_box_is_read() -> None:
    (surface,) = read_surfaces(parse_gltf_file(box_glb()), no_images)
    assert len(surface.triangles) == 12
