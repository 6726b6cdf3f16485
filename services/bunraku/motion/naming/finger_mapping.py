"""Mapping of source joints to fingers: by their names, else by the shape of the hand.

Only joints below a wrist are fingers of that hand, so words for sides do not matter. Metacarpal bones, which lie in the
palm, are no joints of fingers; a joint that only marks the end of the last bone is its tip.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bunraku.motion.hands import FINGERS, MAX_CHAIN_JOINTS
from bunraku.motion.naming.finger_name import FingerName, FingerPart, parse_finger_name
from bunraku.motion.naming.joint_name import split_words, strip_numbers
from bunraku.motion.rotation import Array, normalise

MAX_PATH_JOINTS = 6
"""Joints of a finger that are looked at: a metacarpal bone, three joints, a tip, and one to spare."""
MAX_HAND_M = 0.4
"""Farthest joint of a finger from its wrist, of a body of any size."""
MIN_SHAPE_CHAINS = 3
"""Fewest chains below a wrist that are fingers by their shape."""
MIN_CHAIN_JOINTS = 2
"""Fewest joints of a chain that is a finger by its shape, its tip included."""
PALM_RATIO = 0.75
"""A finger's first bone lies in the palm if it starts nearer to the wrist than this share of its own length."""
MIN_THUMB_SCORE = 0.45
"""Divergence from the other fingers, in radians, from which on one of four or fewer is a thumb."""
_NO_FINGER_WORDS = re.compile(
    "weapon|sword|gun|bow|blade|knife|shield|staff|prop|attach|attachment|socket|sleeve|twist|roll|item|cloth|cuff|"
    "bracelet|watch|fan|string|cable|hair|ribbon|wing|ik|ctrl|control|target|pole"
)


@dataclass(frozen=True, slots=True)
class FingerChain:
    """Source joints of a finger from the wrist outwards, at most three, and the one at its tip, if the source has it.

    `may_be_tip` says that the last joint may be only the end of the bone before, as nothing says otherwise.
    """

    joints: tuple[int, ...] = ()
    tip: int | None = None
    may_be_tip: bool = False

    @property
    def path(self) -> tuple[int, ...]:
        """Joints and tip."""
        return self.joints if self.tip is None else (*self.joints, self.tip)


def map_fingers(
    names: Sequence[str], parents: Sequence[int], positions: Array, wrists: Sequence[int | None]
) -> tuple[FingerChain, ...]:
    """Return the ten chains of fingers, in the order of `hands.HANIM_NAMES`, empty where the source has none.

    Args:
        names: Names of the source's joints.
        parents: Parents of the joints, before their children.
        positions: World positions (J, 3) at rest, in the figure's axes (z forwards), metres.
        wrists: Source joints of the left and the right wrist, None if there is none.
    """
    chains: list[FingerChain] = []
    for wrist in wrists:
        fingers = {} if wrist is None else _map_hand(names, parents, positions, wrist)
        chains += [fingers.get(finger, FingerChain()) for finger in range(len(FINGERS))]
    return tuple(chains)


def _map_hand(names: Sequence[str], parents: Sequence[int], positions: Array, wrist: int) -> dict[int, FingerChain]:
    """Return the fingers of one hand by their place in `hands.FINGERS`."""
    children: dict[int, list[int]] = {wrist: []}
    for joint in range(wrist + 1, len(parents)):
        if parents[joint] in children:
            children[parents[joint]].append(joint)
            children[joint] = []
    named = _parse_names(names, [*children][1:])
    if named:
        paths = _find_named_paths(named, parents, children)
    else:
        paths = _find_paths_by_shape(names, positions, wrist, children)
    fingers = {}
    for finger, path in paths.items():
        chain = _divide_path(finger, path, named, positions, wrist, children)
        reach = np.linalg.norm(positions[list(chain.path)] - positions[wrist], axis=-1)
        if chain.joints and reach.max() <= MAX_HAND_M:
            fingers[finger] = chain
    return fingers


def _parse_names(names: Sequence[str], joints: Sequence[int]) -> dict[int, FingerName]:
    """Return what names say about fingers; if that is nothing, without the joints' own numbers at their ends."""
    for known in (names, strip_numbers(names)):
        found = {joint: parse_finger_name(known[joint]) for joint in joints} if known is not None else {}
        if any(found.values()):
            return {joint: name for joint, name in found.items() if name is not None}
    return {}


def _find_named_paths(
    named: dict[int, FingerName], parents: Sequence[int], children: dict[int, list[int]]
) -> dict[int, list[int]]:
    """Return the longest path of joints of each finger that names tell."""
    within = set(named)
    for joint in sorted(children):
        if parents[joint] in within:
            within.add(joint)
    roots = [joint for joint in named if parents[joint] not in within]
    numbers = {named[root].number for root in roots if named[root].finger is None}
    # numbers start at the thumb, or after a thumb that has its name
    has_thumb = any(named[root].finger == 0 for root in roots)
    first = (0 if 0 in numbers else 1) - (1 if has_thumb else 0)
    longest = _longest_paths(named, children)
    paths: dict[int, list[int]] = {}
    for root in roots:
        name, path = named[root], longest[root]
        finger = name.finger if name.finger is not None else (name.number or 0) - first
        if 0 <= finger < len(FINGERS) and len(path) > len(paths.get(finger, ())):
            paths[finger] = path
    return paths


def _longest_paths(named: dict[int, FingerName], children: dict[int, list[int]]) -> dict[int, list[int]]:
    """Return the longest path down named joints from each of them; the joint at its end may have any name."""
    paths: dict[int, list[int]] = {}
    for joint in sorted(named, reverse=True):
        below = [paths[child] for child in children[joint] if child in named]
        if not below and len(children[joint]) == 1 and not children[children[joint][0]]:
            below = [children[joint]]
        # a finger has few joints: longer ones are cut, so that a chain of thousands is not copied again and again
        paths[joint] = [joint, *max(below, key=len, default=[])][:MAX_PATH_JOINTS]
    return paths


def _find_paths_by_shape(
    names: Sequence[str], positions: Array, wrist: int, children: dict[int, list[int]]
) -> dict[int, list[int]]:
    """Return the fingers of a hand whose joints' names tell none."""
    paths: list[list[int]] = []
    starts = children[wrist][::-1]
    while starts:
        joint = starts.pop()
        if any(_NO_FINGER_WORDS.fullmatch(word) for word in split_words(names[joint])):
            continue
        path = [joint]
        while len(children[path[-1]]) == 1:
            path.append(children[path[-1]][0])
        branches = [child for child in children[path[-1]] if children[child]]
        if len(branches) > 1:
            starts += branches[::-1]
        elif MIN_CHAIN_JOINTS <= len(path) <= MAX_PATH_JOINTS:
            paths.append(path)
    paths = [path for path in paths if np.linalg.norm(positions[path] - positions[wrist], axis=-1).max() <= MAX_HAND_M]
    if not MIN_SHAPE_CHAINS <= len(paths) <= len(FINGERS):
        return {}
    return _order_across(paths, positions, wrist)


def _order_across(paths: list[list[int]], positions: Array, wrist: int) -> dict[int, list[int]]:
    """Return paths as fingers: the thumb diverges from the others and starts near the wrist; they follow it across."""
    bases = np.array([positions[path[0]] for path in paths]) - positions[wrist]
    ends = np.array([positions[path[-1]] for path in paths]) - positions[wrist]
    along = normalise(ends - bases)
    middles = 0.5 * (bases + ends)
    distances = np.linalg.norm(middles, axis=-1)
    scores = []
    for number in range(len(paths)):
        others = [other for other in range(len(paths)) if other != number]
        angle = float(np.arccos(np.clip(along[number] @ normalise(along[others].mean(axis=0)), -1.0, 1.0)))
        scores.append(angle + 1.0 - float(distances[number] / max(np.median(distances[others]), 1e-9)))
    thumb = int(np.argmax(scores))
    has_thumb = len(paths) == len(FINGERS) or scores[thumb] >= MIN_THUMB_SCORE
    rest = [number for number in range(len(paths)) if number != thumb or not has_thumb]
    centred = middles[rest] - middles[rest].mean(axis=0)
    forwards = normalise(along[rest].mean(axis=0))
    across = np.linalg.svd(centred - np.outer(centred @ forwards, forwards))[2][0]
    # the index finger is on the thumb's side, or in front
    side = (middles[thumb] - middles[rest].mean(axis=0)) @ across if has_thumb else across[2]
    rest.sort(key=lambda number: float(middles[number] @ across) * (-1.0 if side > 0 else 1.0))
    order = ([thumb] if has_thumb else []) + rest
    return {place + (0 if has_thumb else 1): paths[number] for place, number in enumerate(order)}


def _divide_path(
    finger: int,
    path: list[int],
    named: dict[int, FingerName],
    positions: Array,
    wrist: int,
    children: dict[int, list[int]],
) -> FingerChain:
    """Return the joints of a finger on its path, without the palm's, and the tip."""
    parts = [named[joint].part if joint in named else FingerPart.UNKNOWN for joint in path]
    joints, tip = list(path), None
    if (parts[-1] is FingerPart.TIP or (named and path[-1] not in named)) and not children[path[-1]]:
        tip = joints.pop()
    while joints and finger and _is_in_palm(joints, named, positions, wrist):
        joints = joints[1:]
    if len(joints) > MAX_CHAIN_JOINTS:
        joints, beyond = joints[:MAX_CHAIN_JOINTS], joints[MAX_CHAIN_JOINTS]
        tip = beyond if tip is None else tip
    last = named.get(joints[-1]) if joints else None
    says_joint = last is not None and (last.part is FingerPart.LAST or last.joint_number == MAX_CHAIN_JOINTS)
    return FingerChain(tuple(joints), tip, tip is None and len(joints) > 1 and not says_joint)


def _is_in_palm(joints: list[int], named: dict[int, FingerName], positions: Array, wrist: int) -> bool:
    """Return whether the first of a finger's joints starts a metacarpal bone."""
    name = named.get(joints[0])
    if name is not None and name.part is FingerPart.PALM:
        return True
    if len(joints) <= MAX_CHAIN_JOINTS:
        return False
    if name is not None and name.joint_number == 0:
        return True
    start, end = positions[joints[0]], positions[joints[1]]
    return bool(np.linalg.norm(start - positions[wrist]) < PALM_RATIO * np.linalg.norm(end - start))
