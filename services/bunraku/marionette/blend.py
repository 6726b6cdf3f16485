"""An arm between the dance's way of reaching its hand tip and the marionette's.

Both arms are seen in the frame of their chord, the line from shoulder to tip with the plane of the elbow about it.
There they differ by little, and mixing their joints moves the tip by little; the arm is then closed on the target
again, so that the tip is exact all the way. What is left of jumps turns nothing but the elbow about the chord, or links
about themselves, and is gone through at a bounded speed.
"""

from __future__ import annotations

from math import atan2, cbrt, copysign, hypot, pi, sqrt

from bunraku.marionette import vector
from bunraku.marionette.limb_rig import ArmRig, JointRotations
from bunraku.marionette.twist import MAX_TWIST_LAG_RAD, MAX_TWIST_SPEED_RAD_S, TwistLimiter
from bunraku.marionette.vector import Quaternion, Vector

SWIVEL_RESET_WEIGHT = 0.05
"""Up to this weight the elbow takes the shortest way round anew: what it came by is hardly seen any more."""
DISTANCE_WEIGHT = 2.0
"""An arm whose tip is half an arm length (1 / `AWAY`) from the dance's may be turned quite otherwise, at any weight."""


class ArmBlend:
    """One arm on its way. It remembers which way round the elbow swings, and how far its links are turned."""

    def __init__(self, rig: ArmRig) -> None:
        self._rig = rig
        self._swivel_rad: float | None = None
        # radians about the chord that the elbow is shown ahead of its way, and goes back
        self._swivel_offset_rad = 0.0
        self._twist_limiter = TwistLimiter(rig.bones)

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
        """The joints at `weight`, `seconds` after the last: 0 gives back the dance's, 1 the bent arm's in the plane of
        `normal`, both as soon as the links have come round.

        `dance` are the pose's joints, `bent` those of `ArmRig.bend` for the `target` (arm lengths, axes of vl5); `turn`
        brings the direction of the dance's own hand to the target's, and `normal` is a unit vector square to that.
        Between, the elbow goes to the nearest place from which forearm and hand reach the target; where the mixed wrist
        leaves none, the tip comes as near as it can.
        """
        direction = self._rig.target_direction(target)
        own = self._rig.tip_target(motion_joints) if weight < 1.0 else target
        # nothing is left of the memory when the limb is the dance's again, so that it is let go without a jump
        share = min(max(cbrt(weight), DISTANCE_WEIGHT * vector.length(vector.subtract(target, own))), 1.0)
        most = min(abs(self._swivel_offset_rad), 2.0 * pi * share)
        self._swivel_offset_rad = copysign(max(most - MAX_TWIST_SPEED_RAD_S * seconds, 0.0), self._swivel_offset_rad)
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
        """The joints below weight 1; `own` is the direction of the dance's hand."""
        rig = self._rig
        direction = rig.target_direction(target)
        own_normal = vector.unit(
            vector.reject_from(rig.plane_normal(motion_joints), motion_direction),
            vector.any_perpendicular(motion_direction),
        )
        carried = vector.rotate(alignment, own_normal)
        swivel = atan2(vector.dot(vector.cross(carried, normal), direction), vector.dot(carried, normal))
        if self._swivel_rad is not None:
            onwards = swivel + 2.0 * pi * round((self._swivel_rad - swivel) / (2.0 * pi))
            if weight > SWIVEL_RESET_WEIGHT and abs(onwards) <= MAX_TWIST_LAG_RAD:
                swivel = onwards
            else:
                # the other way round from here on; it is shown where it was, and comes over
                ahead = self._swivel_offset_rad + weight * (onwards - swivel)
                self._swivel_offset_rad = ahead - 2.0 * pi * round(ahead / (2.0 * pi))
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
        """Shoulder and elbow, turned by as little as brings the tip to `reach` arm lengths along the chord."""
        upper, fore, hand = self._rig.bones
        rest = vector.add(fore, vector.rotate(wrist, hand))
        near, far = vector.length(upper), vector.length(rest)
        chord = max(reach * self._rig.arm_length_m, 1e-9)
        along = min(max((near * near + chord * chord - far * far) / (2.0 * chord), -near), near)
        off = sqrt(max(near * near - along * along, 0.0))
        mixed = vector.rotate(shoulder, upper)
        # where the elbow has to go farther off the chord, it goes to the side of -y: a straight arm leaves open which,
        # and that of the bent arm is there
        farther = max(off - hypot(mixed[1], mixed[2]), 0.0)
        _, y, z = vector.unit((0.0, mixed[1] - farther, mixed[2]), (0.0, -1.0, 0.0))
        place = (along, off * y, off * z)
        before = vector.multiply(shoulder, elbow)
        raised = vector.rotation_between(vector.scale(mixed, 1.0 / near), vector.scale(place, 1.0 / near))
        shoulder = vector.multiply(raised, shoulder)
        lower = vector.unit(vector.rotate(before, rest), (1.0, 0.0, 0.0))
        wanted = vector.unit(vector.subtract((chord, 0.0, 0.0), place), (1.0, 0.0, 0.0))
        turned = vector.multiply(vector.rotation_between(lower, wanted), before)
        return shoulder, vector.normalise(vector.multiply(vector.conjugate(shoulder), turned))
