"""How a dance is written down: poses at beats, steps that land on beats, hops. A score holds no numbers per frame.

Places on the stage are metres from its centre, x to the puppet's left when it faces the audience, z towards the
audience. Angles are degrees. A beat is counted from 0 at the start of the dance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True, slots=True)
class Arm:
    """Where one arm is, the same numbers for either side.

    `wrist` is the wrist from the shoulder as (out, up, forward) of the chest, in lengths of the hanging arm; `elbow`
    the direction (out, up, forward) in which the elbow points; `turn` degrees by which the palm, inwards at rest, is
    turned to the front; `bend` degrees by which the hand is bent to its palm.
    """

    wrist_position: tuple[float, float, float]
    elbow_direction: tuple[float, float, float]
    palm_turn: float = 0.0
    hand_bend: float = 0.0


@dataclass(frozen=True, slots=True)
class Pose:
    """A shape of the body above the feet.

    `left` and `right` are its arms; `depth` metres by which the hips sink below standing; `bow` forward, `lean` and
    `twist` to the left, of the trunk over the hips; `look`, `nod` and `tilt` of the head: to the left of the hips'
    facing, down, and over the left shoulder.
    """

    left: Arm
    right: Arm
    depth: float = 0.03
    bow: float = 0.0
    lean: float = 0.0
    twist: float = 0.0
    look: float = 0.0
    nod: float = 0.0
    tilt: float = 0.0

    def mirror(self) -> Pose:
        """The same pose with left and right exchanged."""
        return replace(
            self,
            left=self.right,
            right=self.left,
            lean=-self.lean,
            twist=-self.twist,
            look=-self.look,
            tilt=-self.tilt,
        )


@dataclass(frozen=True, slots=True)
class PoseKey:
    """The body comes into `pose` at `beat`, having set out `over` beats earlier.

    If it sets out before the key before is reached, it flows through that one. It starts crisply, as a puppet does,
    or, where it is `even`, as a slow sweep does.
    """

    beat: float
    pose: Pose
    transition_beats: float
    is_smooth: bool = False


@dataclass(frozen=True, slots=True)
class FootPlacement:
    """Where a foot stands: the middle of its sole (x, z), metres, and its turn to the left of the audience, degrees."""

    x: float
    z: float
    turn: float = 0.0


FootPlacements = Mapping[Side, FootPlacement]
"""Where both feet stand, or where one or both go."""


@dataclass(frozen=True, slots=True)
class Step:
    """A foot goes to a place and lands at `beat`.

    It is `swing` beats in the air, its sole `lift` metres high at most, and comes down in the last `fall` beats. A
    `stamp` comes down hard and is heard.
    """

    beat: float
    side: Side
    placement: FootPlacement
    swing_beats: float = 0.5
    lift: float = 0.02
    fall_beats: float = 0.25
    is_stamp: bool = False

    @property
    def takeoff_beat(self) -> float:
        """The beat at which the foot leaves the floor."""
        return self.beat - self.swing_beats

    @property
    def targets(self) -> FootPlacements:
        """Where the foot goes, by its side."""
        return {self.side: self.placement}


@dataclass(frozen=True, slots=True)
class Hop:
    """Both feet leave the floor together and land at `beat` in their places, after `flight` beats.

    The soles rise `lift` times as high as the body flies: above 1, the legs are drawn up.
    """

    beat: float
    left: FootPlacement
    right: FootPlacement
    flight_beats: float = 0.42
    lift: float = 1.3

    @property
    def takeoff_beat(self) -> float:
        """The beat at which the feet leave the floor."""
        return self.beat - self.flight_beats

    @property
    def targets(self) -> FootPlacements:
        """Where the feet go, by their sides."""
        return {"left": self.left, "right": self.right}


@dataclass(frozen=True, slots=True)
class Score:
    """A dance of `beats` beats that begins and ends in the pose `rest`, its feet at `left` and `right`.

    Keys and hops are in order of time. ValueError says at which beat a score does not close or lifts a foot when it
    cannot.
    """

    beats_per_minute: float
    beat_count: int
    rest_pose: Pose
    left_foot: FootPlacement
    right_foot: FootPlacement
    keys: tuple[PoseKey, ...]
    steps: tuple[Step, ...]
    hops: tuple[Hop, ...] = ()

    def __post_init__(self) -> None:
        if not self.keys or self.keys[-1].pose != self.rest_pose or self.keys[-1].beat > self.beat_count:
            raise ValueError(f"the last key must bring back the rest pose by beat {self.beat_count}, or a loop jumps")
        reached = 0.0
        for key in self.keys:
            if key.beat < reached or not 0 < key.transition_beats <= key.beat:
                raise ValueError(f"the key at beat {key.beat} must follow beat {reached} and set out after beat 0")
            reached = key.beat
        feet, landed = dict(self.initial_feet), 0.0
        for footfall in self.list_footfalls():
            if footfall.takeoff_beat < landed - 1e-9:
                raise ValueError(
                    f"the step to beat {footfall.beat} begins before beat {landed}, when a foot is in the air"
                )
            feet |= footfall.targets
            landed = footfall.beat
        if feet != self.initial_feet or landed > self.beat_count:
            raise ValueError(f"at beat {landed} the feet are at {feet}, not where they began, so a loop jumps")

    @property
    def initial_feet(self) -> FootPlacements:
        """Where the feet stand at the beginning."""
        return {"left": self.left_foot, "right": self.right_foot}

    def list_footfalls(self) -> list[Step | Hop]:
        """Steps and hops in order of landing."""
        return sorted([*self.steps, *self.hops], key=lambda footfall: footfall.beat)

    @property
    def seconds_per_beat(self) -> float:
        """Seconds from beat to beat."""
        return 60.0 / self.beats_per_minute

    @property
    def duration(self) -> float:
        """Seconds of the whole dance."""
        return self.beat_count * self.seconds_per_beat
