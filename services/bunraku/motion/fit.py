"""State of a figure while it is fitted to a source."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from bunraku.motion import procrustes, rotation
from bunraku.motion.joint_rule import JointRule, aim_at
from bunraku.motion.joint_tree import ancestor_chain
from bunraku.motion.naming.finger_mapping import FingerChain
from bunraku.motion.rest_pose import RestPose
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, PARENTS
from bunraku.motion.source_motion import SourceMotion


@dataclass(slots=True)
class FigureFit:
    """Source in the figure's axes and metres, n frames, and the figure's joints fitted so far.

    `joints` maps H-Anim index to source index; `position` (n, J, 3) are the source's joints and `turn` (n, J, 4) their
    rotation from rest; `rest_positions` (J, 3) and `rest_orientations` (J, 4) describe the source at rest. `fingers`
    are the source's joints of the ten fingers, `eyes` those of the left and the right eye; empty if they are not
    followed. Of the figure: `offsets` and `tips` (18, 3), `rules` by H-Anim index, `joint_positions` (n, 18, 3) and
    `joint_orientations` (n, 18, 4) in the world.
    """

    source: SourceMotion
    joints: dict[int, int]
    scale: float
    position: Array
    turn: Array
    rest_positions: Array
    rest_orientations: Array
    fingers: tuple[FingerChain, ...] = ()
    eyes: tuple[int, ...] = ()
    offsets: Array = field(init=False)
    tips: Array = field(init=False)
    rules: dict[int, JointRule] = field(init=False)
    joint_positions: Array = field(init=False)
    joint_orientations: Array = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.position)
        self.rules = {}
        self.offsets, self.tips = np.zeros((JOINT_COUNT, 3)), np.zeros((JOINT_COUNT, 3))
        self.joint_positions, self.joint_orientations = np.zeros((n, JOINT_COUNT, 3)), np.zeros((n, JOINT_COUNT, 4))

    @classmethod
    def from_source(
        cls,
        source: SourceMotion,
        joints: dict[str, int],
        rest: RestPose,
        fingers: tuple[FingerChain, ...] = (),
        eyes: tuple[int, ...] = (),
    ) -> FigureFit:
        """Return the whole clip of `source` in the figure's axes, with no joint placed yet."""
        index = {JOINT_INDEX[name]: joint for name, joint in joints.items()}
        followed = {*index.values(), *eyes, *(joint for finger in fingers for joint in finger.path)}
        used = sorted({ancestor for joint in followed for ancestor in ancestor_chain(source.parents, joint)})
        position, orientation = source.world_transforms(used)
        axes = rotation.multiply(rest.rest_to_figure, rest.orientations)
        turn = np.zeros_like(orientation)
        turned = rotation.multiply(rest.motion_to_figure, orientation[:, used])
        turn[:, used] = rotation.multiply(turned, rotation.conjugate(axes[used]))
        return cls(
            source=source,
            joints=index,
            scale=rest.scale,
            position=rest.scale * rotation.rotate(rest.motion_to_figure, position),
            turn=turn,
            rest_positions=rest.scale * rotation.rotate(rest.rest_to_figure, rest.positions),
            rest_orientations=axes,
            fingers=fingers,
            eyes=eyes,
        )

    def without_first_frame(self) -> FigureFit:
        """Return the fit without its first frame."""
        return replace(self, position=self.position[1:], turn=self.turn[1:])

    def place_joint(self, joint: int, offset: Array, rule: JointRule) -> None:
        """Place a joint of the figure: `offset` (3,) in its parent, orientation by `rule`. The root has no offset."""
        parent = PARENTS[joint]
        if parent < 0:
            self.joint_positions[:, joint] = self.position[:, self.joints[joint]]
        else:
            self.offsets[joint] = offset
            self.joint_positions[:, joint] = self.joint_positions[:, parent] + rotation.rotate(
                self.joint_orientations[:, parent], offset
            )
        self.rules[joint] = rule
        self.joint_orientations[:, joint] = self._orient_joint(joint, rule)

    def _orient_joint(self, joint: int, rule: JointRule) -> Array:
        """Return the world orientation (n, 4) of a placed joint by its rule."""
        if rule.nearest is not None:
            targets = self.relative_positions(joint, list(rule.nearest.targets))
            orientation = procrustes.solve_kabsch(rule.nearest.local_positions, targets, rule.nearest.weights)
        elif rule.source is not None:
            orientation = rotation.multiply(self.turn[:, rule.source], rule.rest)
        else:
            orientation = self.joint_orientations[:, rule.copied]
        if rule.aim is None:
            return orientation
        start = self.joint_positions[:, joint] if rule.aim.start is None else self.position[:, rule.aim.start]
        return aim_at(orientation, rule.aim.offset, start, self.position[:, rule.aim.target])

    def local_rotations(self) -> Array:
        """Return the rotations (n, 18, 4) of the placed joints in the frames of their parents."""
        rotations = self.joint_orientations.copy()
        parents = self.joint_orientations[:, PARENTS[1:]]
        rotations[:, 1:] = rotation.multiply(rotation.conjugate(parents), self.joint_orientations[:, 1:])
        return rotation.normalise(rotations)

    def relative_positions(self, joint: int, sources: list[int]) -> Array:
        """Return positions (n, m, 3) of `sources` relative to the figure's `joint`, in world axes."""
        found: Array = self.position[:, sources] - self.joint_positions[:, [joint]]
        return found

    def mean_offset(self, parent: int, source: int) -> Array:
        """Return the mean position (3,) of a source joint in the frame of the figure's joint `parent`."""
        place: Array = procrustes.mean_local_positions(
            self.joint_orientations[:, parent], self.relative_positions(parent, [source])
        )[0]
        return place

    def measure_bone(self, joint: int) -> tuple[Array, float]:
        """Return the source's bone from `joint` to the next at rest (3,), and its mean length."""
        start, end = self.joints[joint], self.joints[joint + 1]
        length = np.linalg.norm(self.position[:, end] - self.position[:, start], axis=-1).mean()
        return self.rest_positions[end] - self.rest_positions[start], float(length)

    def farthest_descendant(self, source: int) -> Array | None:
        """Return the vector (3,) from a source joint to its farthest descendant at rest; None if it has none."""
        parents = self.source.parents
        below = [joint for joint in range(source, len(parents)) if source in ancestor_chain(parents, joint)]
        found = [self.rest_positions[joint] - self.rest_positions[source] for joint in below[1:]]
        found += [
            self.rest_positions[end.parent]
            - self.rest_positions[source]
            + self.scale * rotation.rotate(self.rest_orientations[end.parent], end.offset)
            for end in self.source.ends
            if end.parent in below
        ]
        far = max(found, key=lambda v: float(np.linalg.norm(v)), default=None)
        return far if far is not None and np.linalg.norm(far) > 1e-3 else None
