"""One limb between the dance and a hand: taken, pulled, let go.

Each frame the limb is first shown the dance (`see`), then, while it is not wholly the dance's, pulled (`pull`). It
remembers where it is and how fast it goes, and is moved on by the time between frames, in seconds. Places are hand tips
in the shoulder's frame in arm lengths; of a leg the thigh's angle, first of three.
"""

from __future__ import annotations

from bunraku.marionette import vector
from bunraku.marionette.blend import ArmBlend
from bunraku.marionette.elbow import Elbow, lift_between
from bunraku.marionette.follow import STILL, Follower
from bunraku.marionette.handover import HAND_ACCELERATION, THIGH_ACCELERATION, JointMix, Turn, acceleration_home
from bunraku.marionette.limbs import ArmRig, Joints, LegRig, Limb, Pose
from bunraku.marionette.proportions import OUTER_RADIUS
from bunraku.marionette.vector import Vector
from bunraku.motion.skeleton import Figure

MOST_REACH = 0.9995
"""Arm lengths: a pulled arm is never quite locked, so that its elbow leaves the line at a bounded speed."""
LEAST_REACH = 0.15
"""Arm lengths from the shoulder that a hand is pulled to at least: nearer in, the elbow would have to whirl."""
HAND_HOME = 79.0
"""Arm lengths per second squared, against the dance, that a hand let go comes back with at most."""
ARRIVED = 1e-6
"""Arm lengths, or radians, within which a limb is the dance's again."""
LEAST_WEIGHT = 1e-9
"""A limb on its last way home is still solved for."""


class _Pulled:
    """What hands and legs have in common: how the dance has the limb, and how it moves."""

    def __init__(self) -> None:
        self._own: Vector | None = None
        self._before = STILL
        self._velocity = self._velocity_before = STILL
        self._follower: Follower | None = None
        self._home: float | None = None

    @property
    def own(self) -> Vector:
        """Where the dance has the limb, as last seen."""
        return self._own or STILL

    @property
    def pulled(self) -> bool:
        """Whether it is not wholly the dance's."""
        return self._follower is not None

    @property
    def place(self) -> Vector:
        """Where the limb is."""
        return self.own if self._follower is None else self._follower.place

    @property
    def speed(self) -> float:
        """Arm lengths, or radians, per second that it goes at."""
        return 0.0 if self._follower is None else vector.length(self._follower.velocity)

    def _saw(self, own: Vector, seconds: float) -> None:
        self._before = self._own or own
        self._velocity_before = self._velocity
        moved = vector.subtract(own, self._before)
        self._velocity = vector.scale(moved, 1.0 / seconds) if seconds > 0.0 else STILL
        self._own = own

    def _followed(self) -> Follower:
        """What moves the limb; it starts from where the dance had it a frame ago, at the speed it had."""
        if self._follower is None:
            self._follower = Follower(self._before, self._velocity_before)
        return self._follower

    def _homewards(self, most: float) -> float:
        """The acceleration on the way back to the dance, settled when the limb is let go."""
        if self._home is None:
            follower = self._followed()
            away = vector.length(vector.subtract(follower.place, self._before))
            speed = vector.length(vector.subtract(follower.velocity, self._velocity))
            self._home = acceleration_home(away, speed, most)
        return self._home


class PulledHand(_Pulled):
    """One hand of a figure."""

    def __init__(self, figure: Figure, limb: Limb) -> None:
        """Raises `ProportionsError` for an arm whose bones are too short to hang."""
        super().__init__()
        self.rig = ArmRig(figure, limb)
        self.rest()

    def rest(self) -> None:
        """The limb is wholly the dance's."""
        self._follower = self._home = None
        self._elbow = Elbow(self.rig.arm, self.rig.shoulder)
        self._turn = Turn()
        self._blend = ArmBlend(self.rig)

    def see(self, pose: Pose, seconds: float) -> None:
        """The dance's pose, `seconds` after the last."""
        self._saw(self.rig.target(self.rig.dance(pose)), seconds)

    def pull(self, pose: Pose, wanted: Vector | None, weight: float, seconds: float) -> Joints | None:
        """The arm's joints, `seconds` after the last, in the pose that was seen just now; None once it is back.

        The hand is on its way to `wanted`, or, where that is None, back to the dance; `weight` (0..1) says how far the
        arm has gone over from the dance's way of reaching a place to the marionette's.
        """
        rig, follower, own = self.rig, self._followed(), self.own
        if wanted is not None:
            self._home = None
            reach = min(max(vector.length(wanted), LEAST_REACH), MOST_REACH)
            wanted = vector.scale(rig.direction(wanted), reach)
            hand = follower.step(wanted, seconds, HAND_ACCELERATION, rig.arm.inner, OUTER_RADIUS)
        else:
            home = self._homewards(HAND_HOME)
            # the dance may have its hand nearer to the shoulder than one is pulled
            inner = min(rig.arm.inner, vector.length(own))
            hand = follower.step(own, seconds, home, inner, 1.0, self._velocity)
            if weight <= 0.0 and vector.length(vector.subtract(hand, own)) < ARRIVED:
                return None
        dance = rig.dance(pose)
        if not self._elbow.known:
            elbow, chord = rig.places(dance)[0], rig.direction(own)
            self._elbow.begin(chord, rig.bend_axis(dance), lift_between(elbow, chord))
        tip, normal, bend = self._elbow.follow(rig.direction(hand), vector.length(hand), rig.up(pose), seconds)
        bent = rig.bend(vector.length(tip), bend)
        # the dance may hold its arms where the marionette's shoulders do not go: that they do not comes with the weight
        target = vector.add(hand, vector.scale(vector.subtract(tip, hand), weight))
        turn = self._turn.follow(own, target, weight)
        return self._blend.joints(dance, bent, target, turn, normal, max(weight, LEAST_WEIGHT), seconds)


class PulledLeg(_Pulled):
    """One leg of a figure."""

    def __init__(self, figure: Figure, limb: Limb) -> None:
        super().__init__()
        self.rig = LegRig(figure, limb)
        self.rest()

    def rest(self) -> None:
        """The limb is wholly the dance's."""
        self._follower = self._home = None
        self._mix = JointMix()

    def see(self, pose: Pose, seconds: float) -> None:
        """The dance's pose, `seconds` after the last."""
        self._saw((self.rig.angle(pose, self.own[0]), 0.0, 0.0), seconds)

    def pull(self, pose: Pose, wanted: Vector | None, weight: float, seconds: float) -> Joints | None:
        """As `PulledHand.pull`, of the leg's joints."""
        follower, own = self._followed(), self.own
        if wanted is not None:
            self._home = None
            theta = follower.step(wanted, seconds, THIGH_ACCELERATION)[0]
        else:
            home = self._homewards(THIGH_ACCELERATION)
            theta = follower.step(own, seconds, home, carried=self._velocity)[0]
            if weight <= 0.0 and abs(theta - own[0]) < ARRIVED:
                return None
        return self._mix.mix(self.rig.dance(pose), self.rig.hang(theta, pose), max(weight, LEAST_WEIGHT))
