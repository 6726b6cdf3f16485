"""Trees of joints, given as the parent of each joint, -1 for the root; parents come before their children."""

from __future__ import annotations

from collections.abc import Sequence


def ancestor_chain(parents: Sequence[int], joint: int) -> list[int]:
    """Return `joint` and its ancestors up to the root."""
    chain = []
    while joint >= 0:
        chain.append(joint)
        joint = parents[joint]
    return chain


def is_descendant(parents: Sequence[int], joint: int, ancestor: int) -> bool:
    """Return whether `joint` is below `ancestor`, at any depth."""
    while joint >= 0:
        joint = parents[joint]
        if joint == ancestor:
            return True
    return False


def common_ancestor(parents: Sequence[int], joints: Sequence[int]) -> int:
    """Return the lowest joint that is, or is above, all of `joints`."""
    paths: list[list[int]] = []
    for below in joints:
        joint, path = below, [below]
        while parents[joint] >= 0:
            joint = parents[joint]
            path.append(joint)
        paths.append(path[::-1])
    common = 0
    for step in zip(*paths, strict=False):
        if len(set(step)) > 1:
            break
        common = step[0]
    return common
