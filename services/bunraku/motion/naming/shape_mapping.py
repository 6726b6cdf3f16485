"""Mapping of source joints to the figure's joints by the skeleton's shape alone.

A body has two pairs of limbs, left and right alike; each limb has two long bones in a row. The longer pair is the legs.
The head is at the end of the longest branch above the arms. Only the tree and the lengths of bones are used, so the
rest pose does not matter; `rest_pose.resolve_sides` distinguishes left and right by the motion.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from bunraku.motion.errors import UnreadableFile
from bunraku.motion.joint_tree import ancestor_chain, common_ancestor, is_descendant
from bunraku.motion.naming.name_mapping import SHAPE_PROFILE, JointMapping
from bunraku.motion.rotation import Array
from bunraku.motion.source_motion import SourceMotion, bone_lengths

MAX_LENGTH_DIFFERENCE = 0.15
"""Largest difference of left and right bones, as a share of the longer."""
MIN_LIMB_RATIO = 0.2
"""Smallest limb, as a share of the longest one; the distance of the root does not matter."""
MAX_SHORT_RATIO = 0.01
"""Bones shorter than this share of the median have no length: two joints at one place."""
MAX_FOREARM_RATIO = 0.8
"""Collar bone and upper arm count as an arm only if upper arm and forearm are shorter than this share of them."""
MIN_HEAD_RATIO = 0.12
"""Smallest extent of the head above its joint, as a share of a leg's length."""


@dataclass(frozen=True, slots=True)
class _LimbCandidate:
    joints: tuple[int, int, int]
    bone_lengths: tuple[float, float]

    @property
    def length(self) -> float:
        return sum(self.bone_lengths)


def map_by_shape(source: SourceMotion) -> JointMapping:
    """Return the mapping that the skeleton's shape gives, with sides not yet distinguished.

    Raises `UnreadableFile` if the skeleton does not have two pairs of limbs.
    """
    parents = source.parents
    lengths = bone_lengths(source)
    pairs = _find_limb_pairs(source, lengths)
    legs = pairs[0] if pairs else None
    arms = next(
        (pair for pair in pairs if legs and all(_are_disjoint(a, b, parents) for a in pair for b in legs)), None
    )
    if legs is None or arms is None:
        raise UnreadableFile(
            "Not a humanoid",
            "neither the joints' names nor the skeleton's shape show two arms and two legs",
            line=source.joint_lines[0],
            field=source.names[0],
            hint="name the joints as Mixamo, MotionBuilder, VRM or H-Anim do, and send the whole body",
        )
    arms = _skip_collar_bones(arms, pairs)
    joints: dict[str, int] = {}
    for side, leg, arm in zip("lr", legs, arms, strict=True):
        joints |= dict(zip((f"{side}_hip", f"{side}_knee", f"{side}_ankle"), leg.joints, strict=True))
        joints |= dict(zip((f"{side}_shoulder", f"{side}_elbow", f"{side}_wrist"), arm.joints, strict=True))
        toes = _longest_branch(source, lengths, leg.joints[2], set())
        if toes and lengths[toes[0]] > 0.05 * leg.length:
            joints[f"{side}_midtarsal"] = toes[0]
    return JointMapping(SHAPE_PROFILE, joints)


def find_head(source: SourceMotion, joints: dict[str, int]) -> int | None:
    """Return the head's joint: the end of the longest branch that leaves the spine above the hips."""
    lengths = bone_lengths(source)
    arms = [joints["l_shoulder"], joints["r_shoulder"]]
    legs = [joints["l_hip"], joints["r_hip"]]
    leg = lengths[joints["l_knee"]] + lengths[joints.get("l_ankle", joints["l_knee"])]
    chest = common_ancestor(source.parents, arms)
    excluded = {joint for limb in arms + legs for joint in ancestor_chain(source.parents, limb)}
    excluded.discard(chest)
    branch = _longest_branch(source, lengths, chest, excluded)
    above = 0.0
    ends = {end.parent: float(np.linalg.norm(end.offset)) for end in source.ends}
    for joint in reversed(branch):
        above = max(above, ends.get(joint, 0.0))
        if above >= MIN_HEAD_RATIO * leg:
            return joint
        above += lengths[joint]
    return branch[-1] if branch else None


def _find_limb_pairs(source: SourceMotion, lengths: Array) -> list[tuple[_LimbCandidate, _LimbCandidate]]:
    """Return pairs of limbs that are alike and disjoint, longest first."""
    limbs = sorted(_find_limbs(source, lengths), key=lambda limb: -limb.length)[:60]
    found = [
        (a, b)
        for a, b in itertools.combinations(limbs, 2)
        if all(
            abs(x - y) <= MAX_LENGTH_DIFFERENCE * max(x, y) for x, y in zip(a.bone_lengths, b.bone_lengths, strict=True)
        )
        and _are_disjoint(a, b, source.parents)
        and _start_alike(a, b, source)
    ]
    found.sort(key=lambda pair: -min(pair[0].length, pair[1].length))
    return [pair for pair in found if pair[1].length > MIN_LIMB_RATIO * found[0][0].length]


def _skip_collar_bones(
    arms: tuple[_LimbCandidate, _LimbCandidate], pairs: list[tuple[_LimbCandidate, _LimbCandidate]]
) -> tuple[_LimbCandidate, _LimbCandidate]:
    """Return the arms one bone further down if they started with the collar bone, which a hand is too short for."""
    for pair in pairs:
        further = {arm.joints[:2] for arm in pair} == {arm.joints[1:] for arm in arms}
        if further and sum(arm.length for arm in pair) >= MAX_FOREARM_RATIO * sum(arm.length for arm in arms):
            return pair
    return arms


def _find_limbs(source: SourceMotion, lengths: Array) -> list[_LimbCandidate]:
    """Return all pairs of consecutive bones, neither over twice the other; zero-length joints between are skipped."""
    short = MAX_SHORT_RATIO * float(np.median(lengths[lengths > 0.0])) if lengths.any() else 0.0
    found = []
    for end, middle in enumerate(source.parents):
        if middle < 0 or lengths[end] <= short:
            continue
        while lengths[middle] <= short and source.parents[middle] >= 0:
            middle = source.parents[middle]
        start = source.parents[middle]
        bones = (float(lengths[middle]), float(lengths[end]))
        if start >= 0 and max(bones) <= 2.0 * min(bones):
            found.append(_LimbCandidate((start, middle, end), bones))
    return found


def _are_disjoint(a: _LimbCandidate, b: _LimbCandidate, parents: tuple[int, ...]) -> bool:
    """Return whether two limbs share no joint and neither is below the other."""
    if set(a.joints) & set(b.joints):
        return False
    return not is_descendant(parents, a.joints[0], b.joints[0]) and not is_descendant(parents, b.joints[0], a.joints[0])


def _start_alike(a: _LimbCandidate, b: _LimbCandidate, source: SourceMotion) -> bool:
    """Return whether two limbs start equally far from the joint at which they part, as a leg and a neck do not."""
    position = source.rest_positions
    starts = [a.joints[0], b.joints[0]]
    fork = common_ancestor(source.parents, starts)
    distances = np.linalg.norm(position[starts] - position[fork], axis=-1)
    return abs(float(distances[0] - distances[1])) <= MAX_LENGTH_DIFFERENCE * max(a.length, b.length)


def _longest_branch(source: SourceMotion, lengths: Array, start: int, excluded: set[int]) -> list[int]:
    """Return the joints below `start` along its longest branch, without those in `excluded`."""
    reach = np.zeros(len(lengths))
    longest: dict[int, int] = {}
    for end in source.ends:
        reach[end.parent] = max(reach[end.parent], float(np.linalg.norm(end.offset)))
    for joint in range(len(lengths) - 1, 0, -1):
        parent = source.parents[joint]
        length = lengths[joint] + reach[joint]
        if joint not in excluded and (parent not in longest or length > reach[parent]):
            longest[parent] = joint
            reach[parent] = max(reach[parent], length)
    branch_joints = []
    joint = start
    while joint in longest:
        joint = longest[joint]
        branch_joints.append(joint)
    return branch_joints
