"""Skeletons, and the joints that names and shape give (`joint_mapping.json`).

A case has names and parents, and positions at rest if the names tell nothing. `joints` are indices by H-Anim joint;
null, if the skeleton is not mapped. Where the shape gives them, left and right are those of the body's front.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.naming.name_mapping import map_by_name
from bunraku.motion.naming.shape_mapping import map_by_shape
from bunraku.motion.rest_pose import resolve_sides
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINTS, PARENTS, standard_figure
from bunraku.motion.source_motion import SampledMotion
from tests.motion.naming_samples import BODIES, build_body, build_tree

PREFIXES = ("rig:", "Character1_", "Armature|", "Actor 1:Skeleton:", "mixamorig:")
PARTS = (
    "torso,0,0.95,0",
    "torso2,0,1.1,0",
    "torso3,0,1.35,0.01",
    "neck,0,1.5,0",
    "neck2,0,1.62,0.02",
    "arm_#_4,0.2,1.42,0",
    "arm_#_3,0.47,1.4,-0.01",
    "arm_#_2,0.72,1.39,0.02",
    "leg_#_1,0.1,0.9,0",
    "leg_#_2,0.11,0.5,0.02",
    "leg_#_3,0.11,0.09,-0.02",
    "leg_#_5,0.12,0.02,0.12",
)
"""Joints without words for hand, knee or foot, and their positions; `#` is a side. The left is at positive x."""
CHAINS = ("torso,torso2,torso3,neck,neck2", "torso3,arm_#_4,arm_#_3,arm_#_2", "torso,leg_#_1,leg_#_2,leg_#_3,leg_#_5")


def _renamed(name: str, number: int) -> str:
    """Return the name with another place of its side: "UpperLeg.L", "UpLeg_R", "L Thigh"."""
    found = re.match(r"(Left|Right)(.+)", name)
    if found is None:
        return name
    side, stem = found[1], found[2]
    return (f"{stem}.{side[0]}", f"{stem}_{side[0]}", f"{side[0]} {stem}", f"{side[0].lower()}{stem}")[number % 4]


def named_skeletons() -> list[tuple[str, list[str], list[int]]]:
    """Return skeletons as (reason, names, parents), mapped by their names or by none."""
    cases = [(f"names of {name}", *body) for name, (body, _) in BODIES.items()]
    for number, prefix in enumerate(PREFIXES):
        names, parents = BODIES[("MotionBuilder", "LAFAN", "Xsens", "Rokoko", "VRM")[number]][0]
        cases.append((f"prefix {prefix}", [prefix + name for name in names], parents))
    for number in range(4):
        names, parents = BODIES[("Xsens", "MotionBuilder", "Rokoko", "SMPL")[number]][0]
        cases.append((f"place of the side {number}", [_renamed(name, number) for name in names], parents))
    names, parents = BODIES["Mixamo"][0]
    numbered = [f"{name.replace(':', '1:')}_{number:02}" for number, name in enumerate(names)]
    cases.append(("numbers of the joints", numbered, parents))
    spoken = build_body(
        "Hips,Spine,Chest,Neck,Head",
        "Chest",
        "# leg,# knee,# ankle,# toe",
        "# shoulder,# arm,# elbow,# wrist",
        ("Left", "Right"),
    )
    cases.append(("words of speech", *spoken))
    suffixed = [name.replace(" ", ".") + "_Armature" for name in spoken[0]]
    cases.append(("suffix of all names", suffixed, spoken[1]))
    names, parents = BODIES["MotionBuilder"][0]
    swapped = {"LeftUpLeg": "LeftLeg", "LeftLeg": "LeftUpLeg"}
    cases.append(("a child named as its parent", [swapped.get(name, name) for name in names], parents))
    cases.append(("names without a meaning", [f"node{number}" for number in range(len(names))], parents))
    cases.append(("half a body", *build_tree("Hips,LeftUpLeg,LeftLeg,LeftFoot", "Hips,Spine,LeftArm,LeftForeArm")))
    return cases


def shaped_skeletons() -> list[tuple[str, list[str], list[int], Array]]:
    """Return skeletons as (reason, names, parents, positions at rest), mapped by their shape or not at all."""
    names, parents = build_tree(*(chain.replace("#", side) for side in "LR" for chain in CHAINS))
    places = {}
    for part in PARTS:
        name, *place = part.split(",")
        for side, sign in (("L", 1.0), ("R", -1.0)):
            places[name.replace("#", side)] = np.array(place, dtype=float) * [sign, 1.0, 1.0]
    body = np.array([places[name] for name in names])
    unnamed = [f"joint {number}" for number in range(len(names))]
    figure = standard_figure()
    standing = np.zeros((len(JOINTS), 3))
    for joint, parent in enumerate(PARENTS):
        standing[joint] = figure.offsets[joint] + (standing[parent] if parent >= 0 else 0.0)
    turned = rotation.rotate(rotation.from_rotation_vector(np.array([0.0, np.pi, 0.0])), 100.0 * body)
    tail = [("hair", "neck2", [0.0, 2.02, 0.0]), ("hair2", "hair", [0.0, 2.42, 0.02])]
    haired = [*unnamed, *(name for name, _, _ in tail)], [*parents, names.index("neck2"), len(names)]
    hair = np.concatenate([body, [place for _, _, place in tail]])
    legs = [index for index, name in enumerate(names) if name == "torso" or name.startswith("leg")]
    return [
        ("bodies of torsos, arms and legs", names, parents, body),
        ("no names, facing away, in centimetres", unnamed, parents, np.round(turned, 6)),
        ("the standard figure without names", [f"b{number}" for number in range(len(JOINTS))], [*PARENTS], standing),
        ("hair as long as a leg", *haired, hair),
        ("legs alone", [unnamed[k] for k in legs], [-1, 0, 1, 2, 3, 0, 5, 6, 7], body[legs]),
        ("a chain", unnamed[:6], [-1, 0, 1, 2, 3, 4], np.cumsum(np.full((6, 3), 0.1), axis=0)),
        ("one joint", ["Cube"], [-1], np.zeros((1, 3))),
    ]


def _map_shape(names: list[str], parents: list[int], positions: Array) -> dict[str, int] | None:
    facing = np.tile(rotation.IDENTITY, (len(names), 1))
    source = SampledMotion(tuple(names), tuple(parents), (), 30.0, positions, facing, positions[None], facing[None])
    try:
        return resolve_sides(source.positions, map_by_shape(source))[0]
    except UnreadableFile:
        return None


def make_vectors() -> dict[str, Any]:
    """Return the cases that are mapped by names, and those that are mapped by shape."""
    by_name = []
    for reason, names, parents in named_skeletons():
        found = map_by_name(names, parents)
        by_name.append(
            {
                "why": reason,
                "names": names,
                "parents": parents,
                "profile": found and found.profile,
                "joints": found and found.joints,
            }
        )
    by_shape = [
        {
            "why": reason,
            "names": names,
            "parents": parents,
            "positions": positions.tolist(),
            "joints": _map_shape(names, parents, positions),
        }
        for reason, names, parents, positions in shaped_skeletons()
    ]
    return {"by_name": by_name, "by_shape": by_shape}
