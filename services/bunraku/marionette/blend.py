"""Blend of an arm between the stored motion's joints and the solver's.

Both arms are expressed in the frame of their chord, the segment from shoulder to tip with the plane of the elbow. There
they differ little, and interpolating their joints moves the tip little; the arm is then closed on the target again, so
that the tip is exact throughout. The jumps that remain affect only the swivel of the elbow about the chord and the
twist of the bones, and both change at a bounded speed.
"""

from __future__ import annotations

from math import atan2, cbrt, copysign, hypot, pi, sqrt

from bunraku.marionette.constants import (
    DISTANCE_WEIGHT,
    MAX_TWIST_LAG_RAD,
    MAX_TWIST_SPEED_RAD_S,
    SWIVEL_RESET_WEIGHT,
)
from bunraku.marionette.limb_rig import ArmRig
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.limb_solver import LimbSolver
from bunraku.marionette.solver.vector import JointRotations, Quaternion, Vector
from bunraku.marionette.twist import TwistLimiter


class ArmBlend:
    """Blend of one arm, with the state of the elbow's swivel and of the bones' twist."""

    def __init__(self, rig: ArmRig) -> None:
        self._rig = rig
        self._swivel_rad: float | None = None
        # decaying offset about the chord that hides a change of the way round
        self._swivel_offset_rad = 0.0
        self._twist_limiter = TwistLimiter(rig.bones, rig.solver)

    def use_solver(self, solver: LimbSolver) -> None:
        """Use another solver from the next call on."""
        self._twist_limiter.solver = solver

    def blend(
        self,
        motion_joints: JointRotations,
        solved_joints: JointRotations,
        target: Vector,
        alignment: Quaternion,
        normal: Vector,
        weight: float,
        seconds: float,
    ) -> JointRotations:
        """Return the joints at `weight`, `seconds` after the last call.

        Weight 0 gives the motion's joints and weight 1 the solver's in the plane of `normal`, both once no bone's twist
        lags. `solved_joints` are those of `ArmRig.bend_joints` for the `target` (arm lengths, axes of vl5).
        `alignment` rotates the direction of the motion's hand to the target's; `normal` is a unit vector perpendicular
        to the target. In between, the elbow is at the nearest position from which forearm and hand reach the target. If
        the interpolated wrist leaves none, the tip comes as near as it can.
        """
        direction = self._rig.target_direction(target)
        own = self._rig.tip_target(motion_joints) if weight < 1.0 else target
        # offset and lag vanish with the weight, so that the release of the limb is no jump
        share = min(max(cbrt(weight), DISTANCE_WEIGHT * vector.length(vector.subtract(target, own))), 1.0)
        offset = min(abs(self._swivel_offset_rad), 2.0 * pi * share)
        self._swivel_offset_rad = copysign(max(offset - MAX_TWIST_SPEED_RAD_S * seconds, 0.0), self._swivel_offset_rad)
        if weight >= 1.0:
            self._swivel_rad = None
            plane = (
                vector.rotate(vector.from_axis_angle(direction, self._swivel_offset_rad), normal)
                if self._swivel_offset_rad
                else normal
            )
            shoulder = vector.multiply(self._rig.chord_frame(direction, plane), solved_joints[0])
            joints = (vector.normalise(shoulder), solved_joints[1], solved_joints[2])
        else:
            joints = self._blend_joints(
                motion_joints, self._rig.target_direction(own), solved_joints, target, alignment, normal, weight
            )
        return self._twist_limiter.limit(joints, share, seconds)

    def _blend_joints(
        self,
        motion_joints: JointRotations,
        motion_direction: Vector,
        solved_joints: JointRotations,
        target: Vector,
        alignment: Quaternion,
        normal: Vector,
        weight: float,
    ) -> JointRotations:
        """Return the joints below weight 1; `motion_direction` is the direction of the motion's hand."""
        rig = self._rig
        direction = rig.target_direction(target)
        own_normal = vector.unit(
            vector.reject_from(rig.plane_normal(motion_joints), motion_direction),
            vector.any_perpendicular(motion_direction),
        )
        carried = vector.rotate(alignment, own_normal)
        swivel = atan2(vector.dot(vector.cross(carried, normal), direction), vector.dot(carried, normal))
        if self._swivel_rad is not None:
            continued = swivel + 2.0 * pi * round((self._swivel_rad - swivel) / (2.0 * pi))
            if weight > SWIVEL_RESET_WEIGHT and abs(continued) <= MAX_TWIST_LAG_RAD:
                swivel = continued
            else:
                # the other way round from now on: the offset keeps the shown elbow in place and decays
                offset = self._swivel_offset_rad + weight * (continued - swivel)
                self._swivel_offset_rad = offset - 2.0 * pi * round(offset / (2.0 * pi))
        self._swivel_rad = swivel
        if weight <= 0.0:
            return motion_joints
        plane = vector.rotate(vector.from_axis_angle(direction, swivel * weight + self._swivel_offset_rad), carried)
        in_chord = vector.multiply(vector.conjugate(rig.chord_frame(motion_direction, own_normal)), motion_joints[0])
        shoulder = vector.slerp(in_chord, solved_joints[0], weight)
        elbow, wrist = (vector.slerp(a, b, weight) for a, b in zip(motion_joints[1:], solved_joints[1:], strict=True))
        shoulder, elbow = self._close_on_tip(shoulder, elbow, wrist, vector.length(target))
        return (vector.normalise(vector.multiply(rig.chord_frame(direction, plane), shoulder)), elbow, wrist)

    def _close_on_tip(
        self, shoulder: Quaternion, elbow: Quaternion, wrist: Quaternion, reach: float
    ) -> tuple[Quaternion, Quaternion]:
        """Return shoulder and elbow rotated least so that the tip is at `reach` arm lengths along the chord."""
        upper, fore, hand = self._rig.bones
        rest = vector.add(fore, vector.rotate(wrist, hand))
        upper_length, rest_length = vector.length(upper), vector.length(rest)
        chord = max(reach * self._rig.arm_length_m, 1e-9)
        along = min(
            max(
                (upper_length * upper_length + chord * chord - rest_length * rest_length) / (2.0 * chord), -upper_length
            ),
            upper_length,
        )
        off = sqrt(max(upper_length * upper_length - along * along, 0.0))
        mixed = vector.rotate(shoulder, upper)
        # an elbow that must move away from the chord moves towards -y: a straight arm leaves the side open, and the
        # elbow of the bent arm is there
        farther = max(off - hypot(mixed[1], mixed[2]), 0.0)
        _, y, z = vector.unit((0.0, mixed[1] - farther, mixed[2]), (0.0, -1.0, 0.0))
        position = (along, off * y, off * z)
        before = vector.multiply(shoulder, elbow)
        raised = vector.rotation_between(
            vector.scale(mixed, 1.0 / upper_length), vector.scale(position, 1.0 / upper_length)
        )
        shoulder = vector.multiply(raised, shoulder)
        lower = vector.unit(vector.rotate(before, rest), (1.0, 0.0, 0.0))
        goal = vector.unit(vector.subtract((chord, 0.0, 0.0), position), (1.0, 0.0, 0.0))
        turned = vector.multiply(vector.rotation_between(lower, goal), before)
        return shoulder, vector.normalise(vector.multiply(vector.conjugate(shoulder), turned))
