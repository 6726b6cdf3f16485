"""FBX as programs write it: one row per dialect."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

from bunraku.motion import rotation
from bunraku.motion.readers.bvh import Bvh, parse_bvh
from bunraku.motion.rotation import Array
from tests.motion.readers.dialects import FRAMES, Reads, Refused, check
from tests.motion.readers.fbx_tree import MAGIC, FbxNode, ObjectName, block, leaf, to_ascii, to_binary
from tests.motion.readers.fbx_writer import (
    CONSTANT_KEYS,
    CUBIC_KEYS,
    MODEL_ID,
    ORDERS,
    TAKE_ID,
    TICKS_PER_SECOND,
    add_track,
    build_fbx,
    to_degrees,
    write_fbx_6,
)
from tests.motion.readers.sources import local_transforms
from tests.motion.synthetic_motion import bone_aligned, export_bvh, smooth_motion

DANCE = smooth_motion(frames=FRAMES)
NAMES = ("humanoid_root", "l_hip")
LAYER = TAKE_ID + 1
EXTRA = 900_000
"""Numbers of objects that a case adds begin here."""


@cache
def source(units_per_metre: float = 100.0) -> Bvh:
    return parse_bvh(export_bvh(DANCE, units_per_metre=units_per_metre))


TIMES = np.round(np.arange(FRAMES) * TICKS_PER_SECOND / 30.0).astype(np.int64)
CENTIMETRES = {"UnitScaleFactor": 1.0}


def ascii_file(**options: Any) -> Callable[[], bytes]:
    return lambda: to_ascii(build_fbx(source(), **options))


def sized(units_per_metre: float, factor: float) -> Callable[[], bytes]:
    """Return the dance in a unit, whose centimetres the file says."""
    return lambda: to_ascii(build_fbx(source(units_per_metre), settings={"UnitScaleFactor": factor}))


def edited(change: Callable[[list[FbxNode], list[FbxNode]], object], **options: Any) -> Callable[[], bytes]:
    """Return the file with a change of its objects and connections."""

    def build() -> bytes:
        tree = build_fbx(source(), **options)
        objects, links = (
            next(node.children for node in tree if node.name == name) for name in ("Objects", "Connections")
        )
        assert objects is not None
        assert links is not None
        change(objects, links)
        return to_ascii(tree)

    return build


def models(objects: list[FbxNode]) -> list[FbxNode]:
    return [node for node in objects if node.name == "Model"]


def curves(objects: list[FbxNode]) -> list[FbxNode]:
    return [node for node in objects if node.name == "AnimationCurve"]


def set_property(model: FbxNode, name: str, *values: Any) -> None:
    properties = model.child("Properties70").children
    assert properties is not None
    properties[:] = [prop for prop in properties if prop.values[0] != name]
    properties.append(leaf("P", name, "", "", "A", *values))


def rename(change: Callable[[str], str]) -> Callable[[], bytes]:
    def edit(objects: list[FbxNode], _: list[FbxNode]) -> None:
        for model in models(objects):
            assert isinstance(model.values[1], ObjectName)
            model.values[1] = ObjectName("Model", change(model.values[1].name))

    return edited(edit)


def inherit(kind: int, scale: float) -> Callable[[], bytes]:
    """Return the file with a scale of the root, and what its descendants inherit of it."""

    def edit(objects: list[FbxNode], _: list[FbxNode]) -> None:
        root, *others = models(objects)
        set_property(root, "Lcl Scaling", scale, scale, scale)
        for model in others:
            set_property(model, "InheritType", kind)

    return edited(edit, settings=CENTIMETRES)


def animated_scale(objects: list[FbxNode], links: list[FbxNode]) -> None:
    """Animate the scale of the root, which is one."""
    added = add_track(EXTRA, LAYER, MODEL_ID, "Lcl Scaling", TIMES, np.ones((FRAMES, 3)))
    objects += added[0]
    links += added[1]


def joint_translations(objects: list[FbxNode], links: list[FbxNode]) -> None:
    """Animate the translation of each joint."""
    offsets, _ = local_transforms(source())
    for joint in range(1, len(source().names)):
        added = add_track(EXTRA + 10 * joint, LAYER, MODEL_ID + joint, "Lcl Translation", TIMES, offsets[:, joint])
        objects += added[0]
        links += added[1]


def second_layer(mode: int, values: float | None, **members: float) -> Callable[[], bytes]:
    """Return the file with a second layer that blends in a `mode`, of the rotations of the dance or of a value.

    The base layer has the dance if a value is given, else the value 50 degrees.
    """

    def edit(objects: list[FbxNode], links: list[FbxNode]) -> None:
        properties = [leaf("P", "BlendMode", "enum", "", "", mode)]
        properties += [leaf("P", name, "Number", "", "A", value) for name, value in members.items()]
        layer = block("AnimationLayer", EXTRA, ObjectName("AnimLayer", "second"), "")
        layer.children = [block("Properties70", children=properties)]
        objects.append(layer)
        links.append(leaf("C", "OO", EXTRA, TAKE_ID))
        _, turns = local_transforms(source())
        degrees = to_degrees(turns, "XYZ")
        for joint in range(len(source().names)):
            keys = degrees[:, joint] if values is None else np.full((FRAMES, 3), values)
            added = add_track(EXTRA + 1 + 10 * joint, EXTRA, MODEL_ID + joint, "Lcl Rotation", TIMES, keys)
            objects += added[0]
            links += added[1]
        if values is None:
            base = [link.values[1] for link in links if link.values[-1] == "Lcl Rotation"]
            for link in links:
                if str(link.values[-1]).startswith("d|") and link.values[2] in base and link.values[2] < EXTRA:  # type: ignore[operator]
                    curve = next(curve for curve in curves(objects) if curve.values[0] == link.values[1])
                    curve.child("KeyValueFloat").values = [np.full(FRAMES, 50.0)]

    return edited(edit)


def break_curves(change: Callable[[FbxNode], object]) -> Callable[[], bytes]:
    """Return the file with a change of the first curve."""
    return edited(lambda objects, _: change(curves(objects)[0]))


def set_keys(name: str, change: Callable[[Array], Array]) -> Callable[[FbxNode], None]:
    def edit(curve: FbxNode) -> None:
        values = curve.child(name).values[0]
        assert isinstance(values, np.ndarray)
        curve.child(name).values = [change(values.copy())]

    return edit


def put(index: int, value: float) -> Callable[[Array], Array]:
    def change(values: Array) -> Array:
        values[index] = value
        return values

    return change


def without_keys(objects: list[FbxNode], links: list[FbxNode]) -> None:
    objects[:] = [node for node in objects if node.name != "AnimationCurve"]
    links[:] = [link for link in links if not str(link.values[-1]).startswith("d|")]


def as_meshes(objects: list[FbxNode], links: list[FbxNode]) -> None:
    """Make all joints meshes, as of a file that has only a moving prop."""
    objects[:] = [node for node in objects if node.name != "NodeAttribute"]
    for model in models(objects):
        model.values[2] = "Mesh"
        objects.append(block("NodeAttribute", model.values[0] + 200, ObjectName("NodeAttribute", ""), "Mesh"))  # type: ignore[operator]
    for model in models(objects):
        geometry = EXTRA + model.values[0]  # type: ignore[operator]
        objects.append(
            block(
                "Geometry",
                geometry,
                ObjectName("Geometry", ""),
                "Mesh",
                children=[leaf("Vertices", np.zeros(9)), leaf("PolygonVertexIndex", np.array([0, 1, -3]))],
            )
        )
        links.append(leaf("C", "OO", geometry, model.values[0]))


def cycle(_: list[FbxNode], links: list[FbxNode]) -> None:
    links.append(leaf("C", "OO", MODEL_ID, MODEL_ID + 5))
    links[:] = [link for link in links if link.values[1:] != [MODEL_ID, 0]]


def nulls(objects: list[FbxNode], _: list[FbxNode]) -> None:
    """Make all joints nulls, as of capture tools without bones."""
    for node in objects:
        if node.name in ("Model", "NodeAttribute"):
            node.values[2] = "Null"
            if node.name == "NodeAttribute":
                node.children = [leaf("TypeFlags", "Null")]


def text(version: int) -> Callable[[], bytes]:
    return lambda: to_ascii(build_fbx(source()), version)


def binary(version: int, compress: bool = False) -> Callable[[], bytes]:
    return lambda: to_binary(build_fbx(source()), version, compress)


def z_up() -> bytes:
    turned = parse_bvh(export_bvh(DANCE, axes=rotation.from_coordinate_axis(0, np.radians(90.0))))
    axes = {"UpAxis": 2, "UpAxisSign": 1, "FrontAxis": 1, "FrontAxisSign": -1, "CoordAxis": 0, "CoordAxisSign": 1}
    return to_ascii(build_fbx(turned, settings=CENTIMETRES | axes))


def left_handed() -> bytes:
    """Return the dance in axes of which x points the other way."""
    axes = {"UpAxis": 1, "UpAxisSign": 1, "FrontAxis": 2, "FrontAxisSign": 1, "CoordAxis": 0, "CoordAxisSign": -1}
    return to_ascii(build_fbx(MirroredSource(source()), settings=CENTIMETRES | axes))


class MirroredSource:
    """Motion with all x negated."""

    def __init__(self, of: Bvh) -> None:
        self._of = of
        self.names, self.parents, self.fps = of.names, of.parents, of.fps
        self.rest_positions = of.rest_positions * [-1.0, 1.0, 1.0]

    def __getattr__(self, name: str) -> Any:
        return getattr(self._of, name)

    def world_transforms(self, joints: list[int], frames: Any = None) -> tuple[Array, Array]:
        positions, orientations = self._of.world_transforms(joints, frames)
        return positions * [-1.0, 1.0, 1.0], orientations * [1.0, 1.0, -1.0, -1.0]


PLAIN = to_ascii(build_fbx(source()))
BINARY = to_binary(build_fbx(source()))
READ = [
    # versions and notations
    *(Reads(f"ASCII {version}", text(version)) for version in (7100, 7300, 7700)),
    Reads("ASCII with CRLF", lambda: PLAIN.replace(b"\n", b"\r\n")),
    Reads("ASCII 6.1", lambda: write_fbx_6(source())),
    *(Reads(f"binary {version}", binary(version)) for version in (7100, 7200, 7400, 7500, 7700)),
    *(Reads(f"binary {version}, compressed", binary(version, compress=True)) for version in (7400, 7700)),
    Reads("bytes behind the file", lambda: BINARY + b"\n" * 50),
    # size
    Reads("no unit", ascii_file(), unit="cm"),
    Reads("centimetres", sized(100.0, 1.0), unit="cm"),
    Reads("metres", sized(1.0, 100.0), unit="m"),
    Reads("millimetres", sized(1000.0, 0.1), unit="mm"),
    Reads("inches", sized(1.0 / 0.0254, 2.54), unit="inch"),
    Reads("feet", sized(1.0 / 0.3048, 30.48), unit="foot"),
    Reads("child of 0.7 m", sized(40.0, 1.0), unit="cm", size=0.4),
    Reads("giant of 2.7 m", sized(160.0, 1.0), unit="cm", size=1.6),
    Reads(
        "metres called centimetres", sized(1.0, 1.0), unit="m", notes=("its unit is cm, in which a leg has 0.00861 m",)
    ),
    Reads("unit of zero", sized(100.0, 0.0), unit="cm"),
    # axes
    Reads("z up", z_up, notes=("The source's z axis is up",)),
    Reads("left-handed", left_handed, unit="cm"),
    # rotations
    Reads("pre-rotations", ascii_file(pre_rotation=(10.0, 20.0, 30.0))),
    Reads("post-rotations", ascii_file(post_rotation=(10.0, 20.0, 30.0))),
    Reads("both", ascii_file(pre_rotation=(90.0, 0.0, -20.0), post_rotation=(-70.0, 20.0, 5.0), order="YZX")),
    *(Reads(f"order {order}", ascii_file(order=order)) for order in ORDERS),
    Reads("angles that jump by a turn", ascii_file(wrap=True, pre_rotation=(170.0, 0.0, 175.0))),
    Reads(
        "bones along one axis",
        lambda: to_ascii(build_fbx(parse_bvh(export_bvh(DANCE, bone_aligned(DANCE.figure))))),
        apart_mm=30.0,
    ),
    # transforms
    *(Reads(f"inherited scale, type {kind}", inherit(kind, 1.2), size=1.2, apart_mm=None) for kind in (0, 1)),
    Reads("scale that is not inherited", inherit(2, 1.2), apart_mm=None),
    Reads("animated scale", edited(animated_scale)),
    Reads("translations of joints", edited(joint_translations)),
    # keys
    Reads("constant keys", ascii_file(key_flags=CONSTANT_KEYS)),
    Reads("cubic keys", ascii_file(key_flags=CUBIC_KEYS)),
    *(Reads(f"{fps:g} Hz", ascii_file(fps=fps), fps=fps, apart_mm=None) for fps in (24.0, 25.0, 50.0, 60.0, 120.0)),
    *(
        Reads(f"{called} Hz", ascii_file(fps=fps), fps=round(fps, 6), apart_mm=None)
        for called, fps in (("23.976", 24_000 / 1_001), ("29.97", 30_000 / 1_001), ("59.94", 60_000 / 1_001))
    ),
    # layers
    Reads("additive layer of zeros", second_layer(0, 0.0)),
    Reads("layer that overrides", second_layer(1, None)),
    Reads("layer of weight 0", second_layer(2, 70.0, Weight=0.0)),
    Reads("muted layer", second_layer(0, 70.0, Mute=1), apart_mm=None, notes=("The layer 'second' is muted",)),
    # names
    Reads("names with namespace", rename(lambda name: f"Actor:{name}")),
    Reads("names beyond ASCII", rename(lambda name: f"骨_{name}")),
    Reads("nulls instead of bones", edited(nulls)),
    # takes
    Reads("two takes", ascii_file(takes=("dance", "idle")), notes=("Of 2 takes, 'dance' was read",)),
    Reads("chosen take", ascii_file(takes=("long", "dance")), take="long"),
]

REFUSED = [
    Refused("magic only", MAGIC, "Broken FBX file", words="export"),
    Refused("encrypted", MAGIC + bytes(np.random.default_rng(0).integers(0, 256, 5000).tolist()), "Broken FBX file"),
    Refused("cut in half", BINARY[: len(BINARY) // 2], "Broken FBX file", words="export"),
    Refused("ASCII cut in half", PLAIN[: len(PLAIN) // 2], "Broken FBX file"),
    Refused("version 9", MAGIC + b"\x28\x23\0\0" + BINARY[27:], "Broken FBX file"),
    Refused("no take", ascii_file(takes=()), "No animation", words="animation"),
    Refused("no such take", ascii_file(), "No such take", field="take", words="'dance'", take="jump"),
    Refused("curves without keys", edited(without_keys), "Nothing moves", field="dance", words="joints"),
    Refused("meshes only", edited(as_meshes), "No skeleton", words="skeleton"),
    Refused("joints in a circle", edited(cycle), "Broken FBX file"),
    Refused(
        "key at NaN", break_curves(set_keys("KeyValueFloat", put(3, np.nan))), "Broken FBX file", field="humanoid_root"
    ),
    Refused(
        "key at infinity",
        break_curves(set_keys("KeyValueFloat", put(3, np.inf))),
        "Broken FBX file",
        field="humanoid_root",
    ),
    Refused(
        "key at 1e300",
        edited(lambda objects, _: set_keys("KeyValueFloat", put(3, 1e300))(curves(objects)[3])),
        "Broken FBX file",
        field="humanoid_root",
        words="1e+12",
    ),
    Refused(
        "key after a century",
        break_curves(set_keys("KeyTime", put(-1, 10**8 * TICKS_PER_SECOND))),
        "Too much motion",
        words="cut",
    ),
    Refused(
        "fewer values than keys", break_curves(set_keys("KeyValueFloat", lambda values: values[:-1])), "Broken FBX file"
    ),
]


@pytest.mark.parametrize("case", READ, ids=str)
def test_dialect_is_read(case: Reads) -> None:
    check(case)


@pytest.mark.parametrize("case", REFUSED, ids=str)
def test_fault_is_named_with_its_place_and_a_hint(case: Refused) -> None:
    check(case)
