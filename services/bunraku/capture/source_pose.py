"""World transforms of the source's joints, frame by frame; joints that a frame lacks keep their last rotation."""

from __future__ import annotations

from collections.abc import Sequence

from bunraku.capture.frame import CapturedFrame, CaptureSkeleton
from bunraku.marionette.solver.vector import (
    IDENTITY,
    ZERO,
    Quaternion,
    Vector,
    add,
    conjugate,
    multiply,
    rotate,
    subtract,
)


class SourcePose:
    """Last known pose of `joints` of a skeleton, in the sender's axes and unit.

    `parents` are the indices of the nearest ancestors among `joints`, -1 for none; parents come first. `positions` and
    `rotations` are in the world. `offsets` and `turns` are the initial transforms relative to the parents.
    """

    def __init__(
        self, skeleton: CaptureSkeleton, joints: Sequence[str], offsets: Sequence[Vector], turns: Sequence[Quaternion]
    ) -> None:
        self.joints = tuple(joints)
        self.parents = find_parents(skeleton, joints)
        self._in_world = skeleton.in_world
        self.positions: list[Vector] = []
        self.rotations: list[Quaternion] = []
        self._offsets, self._turns = list(offsets), list(turns)
        for index, parent in enumerate(self.parents):
            above, turn = (self.positions[parent], self.rotations[parent]) if parent >= 0 else (ZERO, IDENTITY)
            self.positions.append(add(above, rotate(turn, offsets[index])))
            self.rotations.append(multiply(turn, turns[index]))

    def update(self, frame: CapturedFrame) -> None:
        """Apply a frame."""
        if self._in_world:
            self._update_in_world(frame)
            return
        positions, rotations, offsets, turns = self.positions, self.rotations, self._offsets, self._turns
        new_offset, new_turn = frame.positions.get, frame.rotations.get
        for index, (joint, parent) in enumerate(zip(self.joints, self.parents, strict=True)):
            offset, turn = new_offset(joint), new_turn(joint)
            if offset is None:
                offset = offsets[index]
            else:
                offsets[index] = offset
            if turn is None:
                turn = turns[index]
            else:
                turns[index] = turn
            if parent < 0:
                positions[index], rotations[index] = offset, turn
            else:
                above = rotations[parent]
                positions[index] = add(positions[parent], rotate(above, offset))
                rotations[index] = multiply(above, turn)

    def _update_in_world(self, frame: CapturedFrame) -> None:
        old_positions, old_rotations = self.positions, self.rotations
        positions: list[Vector] = []
        rotations: list[Quaternion] = []
        for index, (joint, parent) in enumerate(zip(self.joints, self.parents, strict=True)):
            position, turn = frame.positions.get(joint), frame.rotations.get(joint)
            if position is None or turn is None:
                offset, local = self._local_transform(index, old_positions, old_rotations)
                above = (positions[parent], rotations[parent]) if parent >= 0 else (ZERO, IDENTITY)
                position = add(above[0], rotate(above[1], offset)) if position is None else position
                turn = multiply(above[1], local) if turn is None else turn
            positions.append(position)
            rotations.append(turn)
        self.positions, self.rotations = positions, rotations

    def _local_transform(
        self, index: int, positions: Sequence[Vector], rotations: Sequence[Quaternion]
    ) -> tuple[Vector, Quaternion]:
        parent = self.parents[index]
        if parent < 0:
            return positions[index], rotations[index]
        back = conjugate(rotations[parent])
        return rotate(back, subtract(positions[index], positions[parent])), multiply(back, rotations[index])

    def local_transforms(self) -> tuple[list[Vector], list[Quaternion]]:
        """Return the positions and rotations of all joints relative to their parents."""
        local = [self._local_transform(index, self.positions, self.rotations) for index in range(len(self.joints))]
        return [offset for offset, _ in local], [turn for _, turn in local]


def find_parents(skeleton: CaptureSkeleton, joints: Sequence[str]) -> list[int]:
    """Return the index of the nearest ancestor of each of `joints` among them, -1 for none."""
    index = {joint: number for number, joint in enumerate(joints)}
    parents = []
    for joint in joints:
        parent = skeleton.parents[joint]
        while parent is not None and parent not in index:
            parent = skeleton.parents[parent]
        parents.append(-1 if parent is None else index[parent])
    return parents
