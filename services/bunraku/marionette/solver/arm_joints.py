"""Joint rotations of an arm that bends in its plane, and the joint positions that follow from rotations.

Plain functions of plain numbers, so that `_kernels` can compile them.
"""

from __future__ import annotations

from bunraku.marionette.constants import MAX_WRIST_BEND_RAD
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.planar_arm import ArmGeometry, close_chain
from bunraku.marionette.solver.vector import JointRotations, Vector


def joint_positions(bones: tuple[Vector, Vector, Vector], joints: JointRotations) -> tuple[Vector, Vector, Vector]:
    """Return elbow, wrist and tip relative to the shoulder, for `bones` at rest."""
    upper, fore, hand = bones
    elbow = vector.rotate(joints[0], upper)
    turn = vector.multiply(joints[0], joints[1])
    wrist = vector.add(elbow, vector.rotate(turn, fore))
    return elbow, wrist, vector.add(wrist, vector.rotate(vector.multiply(turn, joints[2]), hand))


def bend_links(
    geometry: ArmGeometry, rest_frames: JointRotations, palm_turn_rad: float, reach: float, bend: float
) -> JointRotations:
    """Return the joints of an arm with its tip at `reach` and its wrist bent by `bend`, in the frame of its chord.

    `rest_frames` are the orientations of the bones at rest. `palm_turn_rad` is the turn of the palm at the limit of
    the wrist.
    """
    t0, t1, t2 = close_chain(geometry, reach, 0.0, bend)
    first, second, third = rest_frames
    share = (t2 - t1) / MAX_WRIST_BEND_RAD
    palm = vector.from_axis_angle((1.0, 0.0, 0.0), palm_turn_rad * share * share * (3.0 - 2.0 * share))
    elbow = vector.multiply(vector.multiply(vector.about_z(t1 - t0), palm), vector.conjugate(second))
    wrist = vector.multiply(vector.multiply(vector.about_z(t2 - t1), palm), vector.conjugate(third))
    return (
        vector.multiply(vector.about_z(t0), vector.conjugate(first)),
        vector.normalise(vector.multiply(first, elbow)),
        vector.normalise(vector.multiply(vector.multiply(second, vector.conjugate(palm)), wrist)),
    )
