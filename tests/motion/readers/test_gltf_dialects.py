"""glTF as programs write it: one row per dialect."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from bunraku.motion import rotation
from bunraku.motion.readers.bvh import Bvh, parse_bvh
from bunraku.motion.rotation import Array
from tests.motion.readers.dialects import FRAMES, Reads, Refused, check
from tests.motion.readers.sources import pack_glb, unpack_glb, write_glb
from tests.motion.synthetic_motion import export_bvh, smooth_motion

DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
ROOT_TRANSLATION, ROOT_ROTATION = 1, 0
"""Channels of the root."""


@cache
def source(units_per_metre: float = 1.0) -> Bvh:
    return parse_bvh(export_bvh(smooth_motion(frames=FRAMES), units_per_metre=units_per_metre))


class Asset:
    """A valid file, to be changed."""

    def __init__(self) -> None:
        self.document, binary = unpack_glb(write_glb(source()))
        self.binary = bytearray(binary)
        self.nodes: list[dict[str, Any]] = self.document["nodes"]
        self.accessors: list[dict[str, Any]] = self.document["accessors"]
        self.animation: dict[str, Any] = self.document["animations"][0]
        self.channels: list[dict[str, Any]] = self.animation["channels"]
        self.samplers: list[dict[str, Any]] = self.animation["samplers"]
        self.armature = self.nodes[-1]

    def view(self, values: npt.NDArray[Any], kind: int = 5126) -> int:
        """Append values and return the index of their view."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        data = np.asarray(values).astype(DTYPES[kind]).tobytes()
        self.document["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data
        self.document["buffers"][0]["byteLength"] = len(self.binary)
        return len(self.document["bufferViews"]) - 1

    def add(self, values: npt.NDArray[Any], kind: int = 5126, **members: Any) -> int:
        """Append an accessor of values (n,) or (n, m) and return its index."""
        shape = "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}"
        accessor = {"bufferView": self.view(values, kind), "componentType": kind, "count": len(values), "type": shape}
        self.accessors.append(accessor | members)
        return len(self.accessors) - 1

    def read(self, index: int) -> Array:
        """Return the values of an accessor of the original file."""
        accessor = self.accessors[index]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        start = self.document["bufferViews"][accessor["bufferView"]]["byteOffset"]
        values = np.frombuffer(self.binary, "<f4", accessor["count"] * width, start).astype(np.float64)
        return values if width == 1 else values.reshape(-1, width)

    def change_outputs(self, path: str, change: Callable[[Array], int]) -> None:
        """Replace the values of all channels of a path by the accessors that `change` adds."""
        for channel in self.channels:
            if channel["target"]["path"] == path:
                sampler = self.samplers[channel["sampler"]]
                sampler["output"] = change(self.read(sampler["output"]))

    def change_times(self, change: Callable[[Array], Array]) -> None:
        index = self.add(change(self.read(0)))
        for sampler in self.samplers:
            sampler["input"] = index

    def pack(self) -> bytes:
        return pack_glb(self.document, bytes(self.binary))


def edited(change: Callable[[Asset], object]) -> Callable[[], bytes]:
    """Return a function that gives the plain file with a change."""

    def build() -> bytes:
        asset = Asset()
        change(asset)
        return asset.pack()

    return build


def quantised(kind: int) -> Callable[[Asset], None]:
    largest = np.iinfo(DTYPES[kind]).max
    return lambda asset: asset.change_outputs(
        "rotation", lambda values: asset.add(np.round(values * largest), kind, normalized=True)
    )


def sparse(asset: Asset, has_view: bool) -> None:
    """Store all rotations as sparse accessors, of wrong values or zeros that are replaced."""

    def change(values: Array) -> int:
        replaced = np.arange(0, len(values), 2) if has_view else np.arange(len(values))
        wrong = values.copy()
        wrong[replaced] = 7.0
        index = asset.add(wrong)
        if not has_view:
            del asset.accessors[index]["bufferView"]
        asset.accessors[index]["sparse"] = {
            "count": len(replaced),
            "indices": {"bufferView": asset.view(replaced, 5123), "componentType": 5123},
            "values": {"bufferView": asset.view(values[replaced])},
        }
        return index

    asset.change_outputs("rotation", change)


def cubic(asset: Asset) -> None:
    """Store keys with the tangents of the curve."""
    times = asset.read(0)

    def change(values: Array) -> int:
        slopes = np.gradient(values, times, axis=0)
        return asset.add(np.stack([slopes, values, slopes], axis=1).reshape(-1, values.shape[1]))

    for path in ("rotation", "translation"):
        asset.change_outputs(path, change)
    for sampler in asset.samplers:
        sampler["interpolation"] = "CUBICSPLINE"


def set_each(asset: Asset, name: str, value: object) -> None:
    for sampler in asset.samplers:
        sampler[name] = value


def fewer_keys(asset: Asset) -> None:
    """Keep the first of three keys; the last one of 19 is the end."""
    times = asset.add(asset.read(0)[::3])
    for path in ("rotation", "translation"):
        asset.change_outputs(path, lambda values: asset.add(values[::3]))
    set_each(asset, "input", times)


def first_keys(asset: Asset, count: int, step: float = 1.0 / 30.0) -> None:
    times = asset.add(np.arange(count) * step)
    for path in ("rotation", "translation"):
        asset.change_outputs(path, lambda values: asset.add(values[:count]))
    set_each(asset, "input", times)


def flipped_signs(asset: Asset) -> None:
    signs = np.where(np.arange(FRAMES) % 2, -1.0, 1.0)[:, None]
    asset.change_outputs("rotation", lambda values: asset.add(values * signs))


def z_up_armature(asset: Asset) -> None:
    """Lay the dance on its back, and turn the armature so that it stands again, as Blender does."""
    turn = rotation.from_coordinate_axis(0, np.radians(90.0))
    root, armature = asset.nodes[0], asset.armature
    armature["rotation"] = rotation.conjugate(turn)[[1, 2, 3, 0]].tolist()
    root["translation"] = rotation.rotate(turn, np.array(root["translation"])).tolist()
    root["rotation"] = turn[[1, 2, 3, 0]].tolist()
    for channel in asset.channels:
        sampler = asset.samplers[channel["sampler"]]
        if channel["target"] == {"node": 0, "path": "rotation"}:
            turned = rotation.multiply(turn, asset.read(sampler["output"])[:, [3, 0, 1, 2]])
            sampler["output"] = asset.add(turned[:, [1, 2, 3, 0]])
        elif channel["target"]["node"] == 0:
            sampler["output"] = asset.add(rotation.rotate(turn, asset.read(sampler["output"])))


def matrix_nodes(asset: Asset) -> None:
    """Give each node at rest its transform as a matrix."""
    for node in asset.nodes:
        x, y, z = node.pop("translation", (0.0, 0.0, 0.0))
        a, b, c = node.pop("scale", (1.0, 1.0, 1.0))
        node["matrix"] = [a, 0, 0, 0, 0, b, 0, 0, 0, 0, c, 0, x, y, z, 1]


def vrm_names(asset: Asset, extension: str, as_list: bool) -> None:
    """Name the nodes by numbers only, and the bones by the humanoid of VRM."""
    bones = {"humanoid_root": "hips", "vl5": "chest", "skullbase": "head"}
    for letter, side in (("l", "left"), ("r", "right")):
        for joint, bone in zip(
            ("hip", "knee", "ankle", "midtarsal", "shoulder", "elbow", "wrist"),
            ("UpperLeg", "LowerLeg", "Foot", "Toes", "UpperArm", "LowerArm", "Hand"),
            strict=True,
        ):
            bones[f"{letter}_{joint}"] = side + bone
    numbers = {node["name"]: number for number, node in enumerate(asset.nodes)}
    pairs = [(bone, numbers[joint]) for joint, bone in bones.items()]
    human: Any = {bone: {"node": number} for bone, number in pairs}
    if as_list:
        human = [{"bone": bone, "node": number} for bone, number in pairs]
    for number, node in enumerate(asset.nodes):
        node["name"] = f"n{number}"
    asset.document["extensions"] = {extension: {"humanoid": {"humanBones": human}}}


def second_scene(asset: Asset) -> None:
    asset.nodes.append({"name": "camera"})
    asset.document["scenes"] = [{"nodes": [len(asset.nodes) - 1]}, {"nodes": [len(asset.nodes) - 2]}]


def two_animations(asset: Asset) -> None:
    still = {"name": "T-pose", "channels": [], "samplers": []}
    asset.document["animations"].insert(0, still)


def pointer_channel(asset: Asset) -> None:
    asset.channels.insert(0, {"sampler": 0, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {}}}})


def constant_scales(asset: Asset) -> None:
    ones = asset.add(np.ones((FRAMES, 3)))
    for node in range(len(source().names)):
        asset.samplers.append({"input": 0, "output": ones})
        asset.channels.append({"sampler": len(asset.samplers) - 1, "target": {"node": node, "path": "scale"}})


def embedded(asset: Asset) -> bytes:
    uri = "data:application/octet-stream;base64," + base64.b64encode(asset.binary).decode()
    asset.document["buffers"][0]["uri"] = uri
    return json.dumps(asset.document).encode()


def break_values(row: int, value: float) -> Callable[[Asset], None]:
    def change(asset: Asset) -> None:
        values = asset.read(asset.samplers[ROOT_ROTATION]["output"])
        values[row] = value
        asset.samplers[ROOT_ROTATION]["output"] = asset.add(values)

    return change


def break_times(change: Callable[[Array], Array]) -> Callable[[], bytes]:
    return edited(lambda asset: asset.change_times(change))


def append_chunk(data: bytes) -> bytes:
    data += struct.pack("<I4s", 8, b"XTRA") + bytes(8)
    return data[:8] + struct.pack("<I", len(data)) + data[12:]


def set_time(row: int, value: float) -> Callable[[Array], Array]:
    def change(times: Array) -> Array:
        times = times.copy()
        times[row] = value
        return times

    return change


PLAIN = write_glb(source())
READ = [
    # size
    Reads("metres", PLAIN, unit="m"),
    Reads("armature of scale 0.01", write_glb(source(), scale=0.01), unit="m"),
    Reads("centimetres", write_glb(source(100.0)), unit="cm", notes=("its unit is m, in which a leg has 86.1 m",)),
    Reads("child", write_glb(source(0.4)), unit="m", size=0.4),
    Reads("giant", write_glb(source(1.6)), unit="m", size=1.6),
    Reads("too large a giant", write_glb(source(10.0)), unit="unknown", size=0.9527, notes=("unit is unknown",)),
    # container
    Reads("JSON", lambda: embedded(Asset())),
    Reads("JSON with BOM", lambda: b"\xef\xbb\xbf" + embedded(Asset())),
    Reads("unknown chunk", append_chunk(PLAIN)),
    Reads("bytes behind the file", PLAIN + b"\n"),
    Reads("mesh quantization", edited(lambda a: a.document.update(extensionsRequired=["KHR_mesh_quantization"]))),
    # accessors
    Reads("rotations of 16 bits", edited(quantised(5122)), apart_mm=2.0),
    Reads("rotations of 8 bits", edited(quantised(5120)), apart_mm=60.0),
    Reads("sparse accessors", edited(lambda asset: sparse(asset, has_view=True))),
    Reads("sparse accessors of zeros", edited(lambda asset: sparse(asset, has_view=False))),
    # keys
    Reads("step keys", edited(lambda asset: set_each(asset, "interpolation", "STEP"))),
    Reads("cubic keys", edited(cubic)),
    Reads("keys of every third frame", edited(fewer_keys), frames=37, fps=60.0, apart_mm=20.0),
    Reads("first key after 2.5 s", break_times(lambda times: times + 2.5)),
    Reads("first key before zero", break_times(lambda times: times - 1.0)),
    Reads("two keys at one time", break_times(set_time(1, 0.0)), apart_mm=100.0),
    Reads("keys at 29.97 Hz", break_times(lambda times: times * 1.001), fps=29.97003),
    Reads("quaternions of both signs", edited(flipped_signs)),
    Reads(
        "quaternions of length 3",
        edited(lambda asset: asset.change_outputs("rotation", lambda values: asset.add(3.0 * values))),
    ),
    Reads("one key", edited(lambda asset: first_keys(asset, 1)), frames=1, fps=60.0, apart_mm=None),
    Reads("shorter than a frame", edited(lambda asset: first_keys(asset, 2, 0.001)), frames=1, fps=60.0, apart_mm=None),
    Reads("constant scales", edited(constant_scales)),
    Reads("channel of another extension", edited(pointer_channel)),
    # nodes
    Reads("second scene", edited(second_scene)),
    Reads("skin", edited(lambda a: a.document.update(skins=[{"joints": list(range(18)), "skeleton": 0}]))),
    Reads("armature turned to z up", edited(z_up_armature)),
    Reads("matrices", edited(matrix_nodes)),
    Reads("VRM 0", edited(lambda asset: vrm_names(asset, "VRM", as_list=True)), apart_mm=None),
    Reads("VRM 1", edited(lambda asset: vrm_names(asset, "VRMC_vrm", as_list=False)), apart_mm=None),
    Reads("VRMA", edited(lambda asset: vrm_names(asset, "VRMC_vrm_animation", as_list=False)), apart_mm=None),
    Reads("names with namespace", write_glb(source(), tuple(f"rig:{name}" for name in source().names))),
    Reads("an empty animation first", edited(two_animations), notes=("Of 2 takes, 'dance' was read",)),
]


def removed(name: str) -> Callable[[], bytes]:
    return edited(lambda asset: asset.samplers[ROOT_ROTATION].pop(name))


def set_accessor(**members: Any) -> Callable[[], bytes]:
    """Return the file with a changed accessor of the root's rotations."""
    return edited(lambda asset: asset.accessors[asset.samplers[ROOT_ROTATION]["output"]].update(members))


def set_sparse(**members: Any) -> Callable[[], bytes]:
    def change(asset: Asset) -> None:
        sparse(asset, has_view=True)
        asset.accessors[asset.samplers[ROOT_ROTATION]["output"]]["sparse"].update(members)

    return edited(change)


def morph_only(asset: Asset) -> None:
    for channel in asset.channels:
        channel["target"]["path"] = "weights"


def meshopt(asset: Asset) -> None:
    asset.document["bufferViews"][1]["extensions"] = {"EXT_meshopt_compression": {"buffer": 0}}


REFUSED = [
    Refused("version 1", b"glTF\1\0\0\0" + PLAIN[8:], "Not a glTF 2 file", words="version is 1"),
    Refused("cut short", PLAIN[:-100], "Cut short", words="bytes"),
    Refused("cut in the header", PLAIN[:10], "Cut short"),
    Refused("broken JSON", b'{"asset": {"version": "2.0"},\n"nodes": [', "Not a glTF file", line=2),
    Refused("model only", edited(lambda a: a.document.pop("animations")), "No animation", words="animation"),
    Refused("morph targets only", edited(morph_only), "Nothing moves", field="dance", words="no node"),
    Refused("no channels", edited(lambda asset: asset.channels.clear()), "Nothing moves", field="dance"),
    Refused("meshopt", edited(meshopt), "Compressed file", field="bufferViews[1]", words="without compression"),
    Refused(
        "buffer in another file",
        edited(lambda asset: asset.document["buffers"][0].update(uri="dance.bin")),
        "Not one file",
        field="buffers[0]",
        words="GLB",
    ),
    Refused(
        "view beyond the buffer",
        edited(lambda asset: asset.document["bufferViews"][1].update(byteOffset=1 << 30)),
        "Broken glTF file",
        field="bufferViews[1]",
    ),
    Refused("sampler without input", removed("input"), "Broken glTF file", field="accessors"),
    Refused("sampler without output", removed("output"), "Broken glTF file", field="accessors"),
    Refused(
        "no such sampler",
        edited(lambda a: a.channels[0].update(sampler=99)),
        "Broken glTF file",
        field="animations[0].samplers",
    ),
    Refused(
        "no such node", edited(lambda a: a.channels[0]["target"].update(node=99)), "Broken glTF file", field="nodes"
    ),
    Refused(
        "unknown interpolation",
        edited(lambda a: set_each(a, "interpolation", "SMOOTH")),
        "Broken glTF file",
        field="animations[0]",
    ),
    Refused(
        "times that descend", break_times(set_time(3, 0.0)), "Broken glTF file", field="animations[0]", words="ascend"
    ),
    Refused("time NaN", break_times(set_time(3, np.nan)), "Broken glTF file", field="animations[0]", words="ascend"),
    Refused(
        "value NaN", edited(break_values(3, np.nan)), "Broken glTF file", field="animations[0]", words="no numbers"
    ),
    Refused("value infinite", edited(break_values(3, np.inf)), "Broken glTF file", field="animations[0]"),
    Refused("quaternion 0", edited(break_values(3, 0.0)), "Broken glTF file", field="animations[0]", words="zero"),
    Refused("rotations of three numbers", set_accessor(type="VEC3"), "Broken glTF file", field="accessors[1]"),
    Refused("fewer values than keys", set_accessor(count=FRAMES - 1), "Broken glTF file", field="animations[0]"),
    Refused("unknown component type", set_accessor(componentType=5130), "Broken glTF file", field="accessors[1]"),
    Refused("sparse without count", set_sparse(count=None), "Broken glTF file", field="accessors[20].sparse"),
    Refused("sparse of no object", set_accessor(sparse=7), "Broken glTF file", field="accessors[1].sparse"),
    Refused("sparse beyond the end", set_sparse(count=FRAMES + 1), "Broken glTF file", field="accessors[20].sparse"),
    Refused("sparse without indices", set_sparse(indices={}), "Broken glTF file", field="accessors[20].sparse.indices"),
    Refused(
        "lies inside itself",
        edited(lambda a: a.nodes[5].setdefault("children", []).append(18)),
        "Broken glTF file",
        field="nodes[0]",
    ),
    Refused(
        "matrix of zeros", edited(lambda a: a.armature.update(matrix=[0] * 16)), "Broken glTF file", field="nodes[18]"
    ),
    Refused(
        "scale of 1e30", edited(lambda a: a.armature.update(scale=[1e30] * 3)), "Broken glTF file", field="nodes[18]"
    ),
]


@pytest.mark.parametrize("case", READ, ids=str)
def test_dialect_is_read(case: Reads) -> None:
    check(case)


@pytest.mark.parametrize("case", REFUSED, ids=str)
def test_fault_is_named_with_its_place_and_a_hint(case: Refused) -> None:
    check(case)
