"""Faces of glTF 2.0 animations: weights of morph targets, and expressions of VRM.

Specifications: Khronos, glTF 2.0, 3.7.2.2; VRM Consortium, VRM 0.0 (blendShapeMaster), VRMC_vrm-1.0 (expressions) and
VRMC_vrm_animation-1.0 (expressions, lookAt).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.face import GAZE
from bunraku.motion.naming.expression_mapping import map_expression_name
from bunraku.motion.readers.gltf_file import GltfFile, broken
from bunraku.motion.readers.node_motion import Interpolation, NodeMotion, Track, check_shape_frames
from bunraku.motion.rotation import Array

WEIGHTS = "weights"
"""Path of the channels of morph targets."""
MIN_BIND = 0.01
"""Smallest weight of a morph target that counts for an expression."""
MAX_SKINS = 100
"""Skins that are compared to tell figures of one file apart."""
MAX_MESH_NODES = 8
"""Nodes with the same mesh that an expression moves."""
_Morph = tuple[int, int]
"""Node and number of a morph target."""


class _Definition(NamedTuple):
    """Expression of a VRM model: its name, and the weights of the morph targets that show it."""

    name: str
    morphs: dict[_Morph, float]


def find_expression_nodes(file: GltfFile) -> dict[int, str]:
    """Return the expressions of a VRM animation by the nodes whose translation along x is their weight."""
    groups = _member(_extension(file, "VRMC_vrm_animation"), "expressions")
    return {
        file.check_index("nodes", item.get("node")): name
        for group in ("custom", "preset")
        for name, item in _member(groups, group).items()
        if isinstance(item, dict)
    }


def find_gaze_node(file: GltfFile) -> int | None:
    """Return the node of a VRM animation whose rotation is the direction of the eyes, None if there is none."""
    look_at = _member(_extension(file, "VRMC_vrm_animation"), "lookAt")
    return file.check_index("nodes", look_at["node"]) if "node" in look_at else None


def sample_expressions(file: GltfFile, tracks: Mapping[tuple[int, str], Track], motion: NodeMotion) -> dict[str, Array]:
    """Return the weights (n,) of blend shapes and expressions, and the gaze, in all frames of a motion.

    Of several figures with joints of the same names, the first is read.
    """
    morphs = {node: track for (node, path), track in tracks.items() if path == WEIGHTS}
    for node in _find_repeated(file, morphs):
        del morphs[node]
    nodes = {node: name for node, name in find_expression_nodes(file).items() if (node, "translation") in tracks}
    check_shape_frames(motion.frame_count, len(nodes) + sum(track.values.shape[-1] for track in morphs.values()))
    found = _sample_morphs(file, morphs, motion.times)
    for node, name in nodes.items():
        _merge(found, name, tracks[node, "translation"].sample(motion.times)[:, 0])
    gaze = find_gaze_node(file)
    if gaze is not None and (gaze, "rotation") in tracks:
        ahead = rotation.rotate(tracks[gaze, "rotation"].sample(motion.times), np.array([0.0, 0.0, 1.0]))
        angles = np.arctan2(ahead[:, 0], ahead[:, 2]), np.arcsin(np.clip(ahead[:, 1], -1.0, 1.0))
        found |= dict(zip(GAZE, angles, strict=True))
    return found


def read_weights(values: Array, times: Array, interpolation: Interpolation, where: str) -> Track:
    """Return the track of a node's morph targets, with values (k, m) or (k, 3, m), from those of an accessor (n, 1)."""
    keys = len(times) * (3 if interpolation is Interpolation.CUBIC else 1)
    if len(values) % keys or not len(values):
        raise broken(where, f"weights have {len(times)} keys and {len(values)} values")
    shape = (len(times), 3, -1) if interpolation is Interpolation.CUBIC else (len(times), -1)
    return Track(times, values.reshape(shape), interpolation)


def _sample_morphs(file: GltfFile, tracks: Mapping[int, Track], times: Array) -> dict[str, Array]:
    """Return the weights (n,) of morph targets by their names, or of the model's expressions that they show."""
    names = {node: _target_names(file, node, track.values.shape[-1]) for node, track in tracks.items()}
    weights = {
        # each by itself: a track of four numbers is a rotation
        (node, index): Track(track.times, track.values[..., [index]], track.interpolation).sample(times)[:, 0]
        for node, track in tracks.items()
        for index in range(track.values.shape[-1])
    }
    is_known = {(node, index): map_expression_name(names[node][index]) is not None for node, index in weights}
    found: dict[str, Array] = {}
    # symmetric expressions before those of one side, which have fewer targets
    definitions = _find_definitions(file, tracks)
    for name, morphs in sorted(definitions, key=lambda definition: -len(definition.morphs)):
        if not morphs or not morphs.keys() <= weights.keys() or all(is_known[morph] for morph in morphs):
            continue
        shown = np.min([weights[morph] / share for morph, share in morphs.items()], axis=0)
        shown = np.clip(shown, 0.0, 1.0)
        for morph, share in morphs.items():
            weights[morph] = weights[morph] - shown * share
        _merge(found, name, shown)
    defined = {morph for definition in definitions for morph in definition.morphs}
    for (node, index), weight in weights.items():
        if is_known[node, index] or (node, index) not in defined:
            _merge(found, names[node][index], weight)
    return found


def _find_repeated(file: GltfFile, nodes: Iterable[int]) -> list[int]:
    """Return the nodes whose skin has joints of the same names as those of another skin before them."""
    joints = [
        {file.check_index("nodes", joint) for joint in skin.get("joints", ())}
        for skin in file.items("skins")[:MAX_SKINS]
    ]
    names = [{str(file.item("nodes", joint).get("name", joint)) for joint in own} for own in joints]

    def repeats(skin: int, other: int) -> bool:
        shared, fewest = len(names[skin] & names[other]), min(len(names[skin]), len(names[other]))
        is_apart = 0 < fewest <= 2 * shared and joints[skin].isdisjoint(joints[other])
        return is_apart and min(joints[other]) < min(joints[skin])

    compared = range(len(joints))
    repeated = [skin for skin in compared if any(repeats(skin, other) for other in compared)]
    return [node for node in nodes if file.item("nodes", node).get("skin") in repeated]


def _merge(found: dict[str, Array], name: str, weights: Array) -> None:
    """Add weights; the largest count of several meshes that have the same target."""
    found[name] = np.maximum(found[name], weights) if name in found else weights


def _target_names(file: GltfFile, node: int, count: int) -> list[str]:
    """Return the names of the morph targets of a node's mesh; numbers where it has none."""
    item = file.item("nodes", node)
    mesh = file.item("meshes", item["mesh"]) if "mesh" in item else {}
    primitives = mesh.get("primitives")
    owners = [mesh, *(primitives[:1] if isinstance(primitives, list) else [])]
    listed = (_member(owner, "extras").get("targetNames") for owner in owners)
    names = next((each for each in listed if isinstance(each, list)), [])
    own = [name if isinstance(name, str) and name else f"target {index}" for index, name in enumerate(names[:count])]
    return own + [f"target {index}" for index in range(len(own), count)]


def _find_definitions(file: GltfFile, nodes: Iterable[int]) -> list[_Definition]:
    """Return the expressions of a VRM model that have a known name, with their morph targets of the given nodes."""
    found = []
    groups = _member(_extension(file, "VRMC_vrm"), "expressions")
    for group in ("preset", "custom"):
        for name, item in _member(groups, group).items():
            if map_expression_name(name) is not None:
                found.append(_Definition(name, _read_binds(item, "morphTargetBinds", "node", 1.0, {})))
    of_mesh: dict[int, list[int]] = {}
    for node in nodes:
        mesh = file.item("nodes", node).get("mesh")
        if isinstance(mesh, int) and len(of_mesh.setdefault(mesh, [])) < MAX_MESH_NODES:
            of_mesh[mesh].append(node)
    shapes = _member(_extension(file, "VRM"), "blendShapeMaster").get("blendShapeGroups")
    for item in shapes if isinstance(shapes, list) else []:
        names = [item.get(key) for key in ("presetName", "name")] if isinstance(item, dict) else []
        known = [name for name in names if isinstance(name, str) and map_expression_name(name) is not None]
        if known:
            found.append(_Definition(known[0], _read_binds(item, "binds", "mesh", 100.0, of_mesh)))
    return found


def _read_binds(
    item: object, member: str, owner: str, whole: float, nodes_of_mesh: Mapping[int, Sequence[int]]
) -> dict[_Morph, float]:
    """Return the weights of an expression's morph targets, `whole` in the file being one."""
    binds = item.get(member) if isinstance(item, dict) else None
    found: dict[_Morph, float] = {}
    for bind in binds if isinstance(binds, list) else []:
        if not isinstance(bind, dict):
            continue
        place, index, weight = bind.get(owner), bind.get("index"), bind.get("weight", whole)
        if not isinstance(place, int) or not isinstance(index, int) or not isinstance(weight, int | float):
            continue
        if not MIN_BIND * whole <= weight <= whole:
            continue
        nodes = [place] if owner == "node" else nodes_of_mesh.get(place, ())
        found |= {(node, index): weight / whole for node in nodes}
    return found


def _extension(file: GltfFile, name: str) -> dict[str, Any]:
    return _member(file.document.get("extensions"), name)


def _member(item: object, name: str) -> dict[str, Any]:
    """Return a member of an object that is an object itself, else an empty one."""
    found = item.get(name) if isinstance(item, dict) else None
    return found if isinstance(found, dict) else {}
