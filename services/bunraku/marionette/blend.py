"""An arm between the dance's way of reaching its hand tip and the marionette's.

Both arms are seen in the frame of their chord, the line from shoulder to tip with the plane of the elbow about it.
There they differ by little, and mixing their joints moves the tip by little; the arm is then closed on the target
again, so that the tip is exact all the way.
"""

from __future__ import annotations

from math import atan2, pi, sqrt

from bunraku.marionette import vector
from bunraku.marionette.limbs import ArmRig, Joints
from bunraku.marionette.vector import Quaternion, Vector

BELOW = 0.5
"""How far the elbow of a straight arm is drawn to the marionette's side, in parts of the upper arm at weight 1."""


FRESH = 0.05
"""Up to this weight the elbow takes the shortest way round anew: what it came by is hardly seen any more."""


class ArmBlend:
    """One arm on its way. It remembers which way round the elbow swings, so that it never changes its mind halfway."""

    def __init__(self, rig: ArmRig) -> None:
        self._rig = rig
        self._swivel: float | None = None

    def joints(
        self, dance: Joints, bent: Joints, target: Vector, turn: Quaternion, normal: Vector, weight: float
    ) -> Joints:
        """The joints at `weight`: 0 gives back the dance's, 1 the bent arm's in the plane of `normal`.

        `dance` are the pose's joints, `bent` those of `ArmRig.bend` for the `target` (arm lengths, axes of vl5); `turn`
        brings the direction of the dance's own hand to the target's, and `normal` is a unit vector square to that.
        Between, the elbow goes to the nearest place from which forearm and hand reach the target; where the mixed wrist
        leaves none, the tip comes as near as it can.
        """
        rig = self._rig
        direction = rig.direction(target)
        if weight >= 1.0:
            self._swivel = None
            shoulder = vector.multiply(rig.chord(direction, normal), bent[0])
            return (vector.normalise(shoulder), bent[1], bent[2])
        own = rig.direction(rig.target(dance))
        own_normal = vector.unit(vector.square_to(rig.bend_axis(dance), own), vector.across(own))
        carried = vector.rotate(turn, own_normal)
        swivel = atan2(vector.dot(vector.cross(carried, normal), direction), vector.dot(carried, normal))
        if self._swivel is not None and weight > FRESH:
            swivel += 2.0 * pi * round((self._swivel - swivel) / (2.0 * pi))
        self._swivel = swivel
        if weight <= 0.0:
            return dance
        plane = vector.rotate(vector.about(direction, swivel * weight), carried)
        in_chord = vector.multiply(vector.conjugate(rig.chord(own, own_normal)), dance[0])
        shoulder = vector.slerp(in_chord, bent[0], weight)
        elbow, wrist = (vector.slerp(a, b, weight) for a, b in zip(dance[1:], bent[1:], strict=True))
        shoulder, elbow = self._close(shoulder, elbow, wrist, vector.length(target), weight)
        return (vector.normalise(vector.multiply(rig.chord(direction, plane), shoulder)), elbow, wrist)

    def _close(
        self, shoulder: Quaternion, elbow: Quaternion, wrist: Quaternion, reach: float, weight: float
    ) -> tuple[Quaternion, Quaternion]:
        """Shoulder and elbow, turned by as little as brings the tip to `reach` arm lengths along the chord."""
        upper, fore, hand = self._rig.links
        rest = vector.add(fore, vector.rotate(wrist, hand))
        near, far = vector.length(upper), vector.length(rest)
        chord = max(reach * self._rig.scale, 1e-9)
        along = min(max((near * near + chord * chord - far * far) / (2.0 * chord), -near), near)
        off = sqrt(max(near * near - along * along, 0.0))
        mixed = vector.rotate(shoulder, upper)
        # a straight arm leaves open to which side its elbow goes; that of the bent one is on the side of -y
        _, y, z = vector.unit((0.0, mixed[1] - BELOW * weight * near, mixed[2]), (0.0, -1.0, 0.0))
        place = (along, off * y, off * z)
        before = vector.multiply(shoulder, elbow)
        raised = vector.between(vector.scale(mixed, 1.0 / near), vector.scale(place, 1.0 / near))
        shoulder = vector.multiply(raised, shoulder)
        lower = vector.unit(vector.rotate(before, rest), (1.0, 0.0, 0.0))
        wanted = vector.unit(vector.subtract((chord, 0.0, 0.0), place), (1.0, 0.0, 0.0))
        turned = vector.multiply(vector.between(lower, wanted), before)
        return shoulder, vector.normalise(vector.multiply(vector.conjugate(shoulder), turned))
