"""Reader of glTF 2.0 animations: GLB, glTF in JSON, VRM Animation (VRMA) and VRM models with animations.

Specifications: Khronos, glTF 2.0; VRM Consortium, VRM 0.0, VRMC_vrm-1.0 and VRMC_vrm_animation-1.0, whose humanoid
bones name the nodes here.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.errors import UnreadableFile, quote_excerpt
from bunraku.motion.readers.gltf_face import (
    WEIGHTS,
    find_expression_nodes,
    find_gaze_node,
    read_weights,
    sample_expressions,
)
from bunraku.motion.readers.gltf_file import GltfFile, broken, check_index, check_objects, parse_gltf_file, read_numbers
from bunraku.motion.readers.node_motion import (
    Interpolation,
    Node,
    NodeMotion,
    Track,
    choose_rate,
    sample_nodes,
)
from bunraku.motion.readers.takes import choose_take, describe_choice, name_takes
from bunraku.motion.rotation import Array

MAX_NODES = 1_000
"""Joints that are read, those that carry nothing but meshes left out."""
METRES_PER_UNIT = 1.0
"""Unit of length (glTF 2.0, 3.4)."""
COMPONENTS = {"translation": 3, "rotation": 4, "scale": 3, WEIGHTS: 1}
_HUMANOIDS = (("VRMC_vrm_animation", "humanoid"), ("VRMC_vrm", "humanoid"), ("VRM", "humanoid"))


def parse_gltf(data: bytes, take: str | None = None) -> NodeMotion:
    """Parse the animation `take` of an asset, by default the one that moves most nodes.

    Raises `UnreadableFile` if the data is no glTF asset or has no such animation.
    """
    file = parse_gltf_file(data)
    animations = file.items("animations")
    if not animations:
        raise UnreadableFile(
            "No animation", "the file has a model, but no animation", hint="export it with its animation"
        )
    names = _take_names(animations)
    channels = [_find_channels(file, animation, f"animations[{number}]") for number, animation in enumerate(animations)]
    chosen = choose_take(names, [len({node for node, path in moved if path != WEIGHTS}) for moved in channels], take)
    tracks = _read_tracks(file, animations[chosen], channels[chosen], f"animations[{chosen}]")
    moved = _find_moved(file, tracks)
    nodes, kept = _read_nodes(file, {node for node, _ in moved})
    for (node, path), track in moved.items():
        nodes[kept[node]].tracks[path] = track
    times = [track.times for (_, path), track in tracks.items() if path != WEIGHTS]
    if all(each[0] == times[0][0] == each[-1] for each in times):
        # only the face moves
        times = [track.times for track in tracks.values()]
    if not nodes or not times:
        raise UnreadableFile(
            "Nothing moves",
            f"the animation {quote_excerpt(names[chosen])} moves no node",
            field=names[chosen],
            hint="export the motion of the skeleton; blend shapes alone move no joint",
        )
    start, end = min(float(each[0]) for each in times), max(float(each[-1]) for each in times)
    motion = sample_nodes(nodes, start, end, choose_rate(times), describe_choice(names, chosen), METRES_PER_UNIT)
    return replace(motion, expressions=sample_expressions(file, tracks, motion))


def list_gltf_takes(data: bytes) -> list[str]:
    """Return the names of an asset's animations. Raises `UnreadableFile` if the data is no glTF asset."""
    return _take_names(parse_gltf_file(data).items("animations"))


def _take_names(animations: list[dict[str, Any]]) -> list[str]:
    return name_takes(str(item.get("name") or f"animation {number}") for number, item in enumerate(animations, 1))


_Channels = dict[tuple[int, str], object]
"""Index of the sampler by node and property."""


def _find_channels(file: GltfFile, animation: dict[str, Any], where: str) -> _Channels:
    """Return the channels of an animation, without those of other properties, and weights of nodes without mesh."""
    found: _Channels = {}
    for channel in check_objects(animation.get("channels", []), f"{where}.channels"):
        target = channel.get("target")
        if not isinstance(target, dict) or "node" not in target:
            continue
        path = target.get("path")
        if isinstance(path, str) and path in COMPONENTS:
            node = file.check_index("nodes", target["node"])
            if path != WEIGHTS or "mesh" in file.item("nodes", node):
                found[node, path] = channel.get("sampler")
    return found


def _read_tracks(
    file: GltfFile, animation: dict[str, Any], channels: _Channels, where: str
) -> dict[tuple[int, str], Track]:
    """Return the tracks of an animation by node and property."""
    samplers = check_objects(animation.get("samplers", []), f"{where}.samplers")
    inputs: dict[int, Array] = {}
    found: dict[tuple[int, str], Track] = {}
    for (node, path), index in channels.items():
        sampler = samplers[check_index(index, samplers, f"{where}.samplers")]
        source = file.check_index("accessors", sampler.get("input"))
        if source not in inputs:
            inputs[source] = _read_times(file, source, where)
        found[node, path] = _read_track(file, sampler, inputs[source], path, where)
    return found


def _find_moved(file: GltfFile, tracks: dict[tuple[int, str], Track]) -> dict[tuple[int, str], Track]:
    """Return the tracks of nodes that may be joints, without those that stand for the expressions of a face."""
    bones = _humanoid_bones(file)
    of_face = {node for node in (*find_expression_nodes(file), find_gaze_node(file)) if node not in bones}
    return {(node, path): track for (node, path), track in tracks.items() if path != WEIGHTS and node not in of_face}


def _read_times(file: GltfFile, index: object, where: str) -> Array:
    times = file.read_accessor(index, 1)[:, 0]
    if not np.isfinite(times).all() or (np.diff(times) < 0.0).any() or abs(times).max() > 1e6:
        raise broken(where, "the times of its keys do not ascend")
    return times


def _read_track(file: GltfFile, sampler: dict[str, Any], times: Array, path: str, where: str) -> Track:
    try:
        interpolation = Interpolation(sampler.get("interpolation", Interpolation.LINEAR))
    except ValueError as error:
        raise broken(where, f"interpolation is {quote_excerpt(str(sampler['interpolation']))}") from error
    values = file.read_accessor(sampler.get("output"), COMPONENTS[path])
    per_key = 3 if interpolation is Interpolation.CUBIC else 1
    if path == WEIGHTS and np.isfinite(values).all():
        return read_weights(values, times, interpolation, where)
    if len(values) != per_key * len(times):
        raise broken(where, f"a {path} has {len(times)} keys and {len(values)} values")
    if not np.isfinite(values).all():
        raise broken(where, f"a {path} has values that are no numbers")
    if path == "rotation" and not (np.abs(values[1::3] if per_key == 3 else values).max(axis=1) > 0.0).all():
        raise broken(where, "a rotation has a quaternion that is zero")
    if path == "rotation":
        values = values[:, [3, 0, 1, 2]]
        if interpolation is not Interpolation.CUBIC:
            values = rotation.normalise(values)
    return Track(times, values.reshape(len(times), 3, -1) if per_key == 3 else values, interpolation)


def _read_nodes(file: GltfFile, moved: set[int]) -> tuple[list[Node], dict[int, int]]:
    """Return the nodes that are `moved`, carry a skin or are bones of a humanoid, with their ancestors, below one root.

    Also returns the position in this list of each node of the file.
    """
    parents = file.find_parents()
    bones = _humanoid_bones(file)
    wanted = {*moved, *bones}
    for number, skin in enumerate(file.items("skins")):
        joints = skin.get("joints", [])
        if not isinstance(joints, list):
            raise broken(f"skins[{number}]", "joints is no list")
        wanted.update(file.check_index("nodes", joint) for joint in joints)
    order = _order_nodes(wanted, parents)
    if len(order) > MAX_NODES:
        raise UnreadableFile(
            "Too many joints", f"over {MAX_NODES:,} joints", field="nodes", hint="export the body's joints only"
        )
    roots = [index for index in order if parents[index] < 0]
    nodes: list[Node] = []
    kept = {-1: -1}
    if len(roots) > 1:
        nodes.append(Node("scene", -1, np.zeros(3), rotation.IDENTITY.copy(), np.ones(3)))
        kept[-1] = 0
    for index in order:
        kept[index] = len(nodes)
        item = file.item("nodes", index)
        name = bones.get(index) or str(item.get("name") or f"node {index}")
        nodes.append(Node(name, kept[parents[index]], *_rest_transform(item, index)))
    return nodes, kept


def _order_nodes(wanted: set[int], parents: list[int]) -> list[int]:
    """Return `wanted` and all their ancestors, parents before their children."""
    order: dict[int, None] = {}
    for index in sorted(wanted):
        path = []
        while index >= 0 and index not in order:
            path.append(index)
            index = parents[index]
        order.update(dict.fromkeys(reversed(path)))
    return list(order)


def _humanoid_bones(file: GltfFile) -> dict[int, str]:
    """Return the names of a VRM humanoid's bones by node."""
    extensions = file.document.get("extensions", {})
    for name, part in _HUMANOIDS:
        extension = extensions.get(name) if isinstance(extensions, dict) else None
        humanoid = extension.get(part) if isinstance(extension, dict) else None
        bones = humanoid.get("humanBones") if isinstance(humanoid, dict) else None
        if isinstance(bones, dict):
            pairs = [(bone, item) for bone, item in bones.items() if isinstance(item, dict)]
        elif isinstance(bones, list):
            pairs = [(str(item.get("bone")), item) for item in bones if isinstance(item, dict)]
        else:
            continue
        return {file.check_index("nodes", item.get("node")): bone for bone, item in pairs}
    return {}


def _rest_transform(item: dict[str, Any], index: int) -> tuple[Array, Array, Array]:
    """Return translation (3,), rotation (4,) and scale (3,) of a node."""
    where = f"nodes[{index}]"
    if "matrix" in item:
        matrix = read_numbers(item["matrix"], 16, where, "transform").reshape(4, 4).T
        scale = np.linalg.norm(matrix[:3, :3], axis=0)
        if not (scale > 0.0).all():
            raise broken(where, "its matrix has no inverse")
        if np.linalg.det(matrix[:3, :3]) < 0.0:
            scale[2] = -scale[2]
        return matrix[:3, 3], rotation.from_matrix(matrix[:3, :3] / scale), scale
    turn = read_numbers(item.get("rotation", [0.0, 0.0, 0.0, 1.0]), 4, where, "transform")[[3, 0, 1, 2]]
    if not np.linalg.norm(turn) > 0.0:
        raise broken(where, "its rotation is zero")
    return (
        read_numbers(item.get("translation", [0.0] * 3), 3, where, "transform"),
        rotation.normalise(turn),
        read_numbers(item.get("scale", [1.0] * 3), 3, where, "transform"),
    )
