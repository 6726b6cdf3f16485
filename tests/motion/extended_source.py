"""Sources for tests whose spine, neck and clavicles turn, in Mixamo's names and metres."""

from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.bvh_writer import euler_zxy
from bunraku.motion.source_motion import EndSite, SampledMotion, chain_transforms

_SIDE = {"Shoulder": (0.04, 0.1, 0.0), "Arm": (0.12, 0.02, 0.0), "ForeArm": (0.28, 0.0, 0.0), "Hand": (0.26, 0.0, 0.0)}
_LEG = {"UpLeg": (0.09, -0.05, 0.0), "Leg": (0.0, -0.42, 0.0), "Foot": (0.0, -0.4, 0.0), "ToeBase": (0.0, -0.06, 0.13)}


def extended_source(
    frames: int = 120, seed: int = 0, spine_count: int = 3, neck_count: int = 1, swing: float = 0.5
) -> SampledMotion:
    """Return a smooth dance in T-pose rest of which every joint turns by up to about `swing` radians."""
    names, parents = ["Hips"], [-1]
    offsets: list[tuple[float, float, float]] = [(0.0, 0.95, 0.0)]

    def add(name: str, parent: str, offset: tuple[float, float, float]) -> str:
        names.append(name)
        parents.append(names.index(parent))
        offsets.append(offset)
        return name

    chest = "Hips"
    for number in range(spine_count):
        chest = add(f"Spine{number or ''}", chest, (0.0, 0.4 / spine_count, 0.0))
    neck = chest
    for number in range(neck_count):
        neck = add(f"Neck{number or ''}", neck, (0.0, 0.16 / neck_count, 0.0))
    add("Head", neck, (0.0, 0.09, 0.02))
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        for parts, above in ((_SIDE, chest), (_LEG, "Hips")):
            for part, (x, y, z) in parts.items():
                above = add(side + part, above, (sign * x, y, z))
    random = np.random.default_rng(seed)
    count = len(names)
    t = np.arange(frames)[:, None, None] / 30.0
    turn = swing / 3**0.5 * random.uniform(-1.0, 1.0, (count, 3))
    swung = turn * np.sin(2.0 * np.pi * random.uniform(0.3, 1.0, (count, 3)) * t)
    places = np.tile(np.array(offsets), (frames, 1, 1))
    places[:, 0] += 0.05 * np.sin(t[:, 0] * [1.0, 2.0, 1.5])
    positions, orientations = chain_transforms(parents, places, rotation.from_rotation_vector(swung))
    still = np.tile(rotation.IDENTITY, (count, 1))
    rest_positions, _ = chain_transforms(parents, np.array(offsets), still)
    ends = (EndSite(names.index("Head"), np.array([0.0, 0.2, 0.0])),)
    return SampledMotion(
        tuple(names),
        tuple(parents),
        ends,
        30.0,
        rest_positions - rest_positions[0],
        still,
        positions,
        orientations,
    )


def write_source_bvh(source: SampledMotion) -> bytes:
    """Return a source as BVH in centimetres."""
    children = [
        [child for child, parent in enumerate(source.parents) if parent == joint] for joint in range(len(source.names))
    ]
    lines, order = ["HIERARCHY"], []

    def add(joint: int, depth: int) -> None:
        order.append(joint)
        parent = source.parents[joint]
        offset = np.zeros(3) if parent < 0 else source.rest_positions[joint] - source.rest_positions[parent]
        kind, channels = ("ROOT", "6 Xposition Yposition Zposition") if parent < 0 else ("JOINT", "3")
        indent = "\t" * depth
        lines.append(f"{indent}{kind} {source.names[joint]}\n{indent}{{")
        lines.append(f"{indent}\tOFFSET " + " ".join(f"{100 * x:.6f}" for x in offset))
        lines.append(f"{indent}\tCHANNELS {channels} Zrotation Xrotation Yrotation")
        for child in children[joint]:
            add(child, depth + 1)
        if not children[joint]:
            lines.append(f"{indent}\tEnd Site\n{indent}\t{{\n{indent}\t\tOFFSET 0 8 0\n{indent}\t}}")
        lines.append(f"{indent}}}")

    add(0, 0)
    local = source.orientations.copy()
    for joint, parent in enumerate(source.parents):
        if parent >= 0:
            local[:, joint] = rotation.multiply(
                rotation.conjugate(source.orientations[:, parent]), source.orientations[:, joint]
            )
    angles = euler_zxy(local[:, order]).reshape(source.frame_count, -1)
    rows = np.concatenate([100 * source.positions[:, 0], angles], axis=1)
    lines += ["MOTION", f"Frames: {len(rows)}", f"Frame Time: {1 / source.fps:.9f}"]
    lines += [" ".join(f"{value:.6f}" for value in row) for row in rows]
    return "\n".join([*lines, ""]).encode()
