"""Score of a choreography: poses at beats, steps that land on beats, hops. It holds no values per frame.

Positions on the stage are metres from its centre, x to the performer's left when it faces the audience, z towards the
audience. Angles are degrees. Beats count from 0 at the start.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True, slots=True)
class Arm:
    """Position of one arm, with the same numbers for either side.

    `wrist_position` is the wrist from the shoulder as (out, up, forward) of the chest, in lengths of the hanging arm;
    `elbow_direction` (out, up, forward) is the direction of the elbow; `palm_turn` degrees by which the palm, inwards
    at rest, is turned to the front; `hand_bend` degrees by which the hand is bent towards its palm.
    """

    wrist_position: tuple[float, float, float]
    elbow_direction: tuple[float, float, float]
    palm_turn: float = 0.0
    hand_bend: float = 0.0


@dataclass(frozen=True, slots=True)
class Pose:
    """Pose of the body above the feet.

    `left` and `right` are the arms; `depth` metres by which the hips sink below standing; `bow` forward, `lean` and
    `twist` to the left, of the trunk relative to the hips; `look`, `nod` and `tilt` of the head: to the left of the
    hips' facing, down, and over the left shoulder.
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
        """Return the pose with left and right exchanged."""
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
    """Key at which the body reaches `pose`: at `beat`, after a transition of `transition_beats`.

    If the transition starts before the previous key is reached, it flows through that key. It starts sharply, as a
    puppet moves, or slowly if `is_smooth`.
    """

    beat: float
    pose: Pose
    transition_beats: float
    is_smooth: bool = False


@dataclass(frozen=True, slots=True)
class FootPlacement:
    """Position of a foot: the centre of its sole (x, z) in metres, and its turn to the audience's left in degrees."""

    x: float
    z: float
    turn: float = 0.0


FootPlacements = Mapping[Side, FootPlacement]
"""Positions of both feet, or targets of one or both."""


@dataclass(frozen=True, slots=True)
class Step:
    """Step of one foot that lands at `beat`.

    The foot swings for `swing_beats`, its sole at most `lift` metres high, and comes down in the last `fall_beats`. A
    stamp comes down hard and is audible.
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
        """Beat at which the foot leaves the floor."""
        return self.beat - self.swing_beats

    @property
    def targets(self) -> FootPlacements:
        """Target of the foot, by its side."""
        return {self.side: self.placement}


@dataclass(frozen=True, slots=True)
class Hop:
    """Hop of both feet that lands at `beat` after `flight_beats`.

    The soles rise `lift` times as high as the body flies: above 1, the legs are drawn up.
    """

    beat: float
    left: FootPlacement
    right: FootPlacement
    flight_beats: float = 0.42
    lift: float = 1.3

    @property
    def takeoff_beat(self) -> float:
        """Beat at which the feet leave the floor."""
        return self.beat - self.flight_beats

    @property
    def targets(self) -> FootPlacements:
        """Targets of the feet, by side."""
        return {"left": self.left, "right": self.right}


@dataclass(frozen=True, slots=True)
class Score:
    """Choreography of `beat_count` beats that starts and ends in `rest_pose`, with the feet at `left_foot` and
    `right_foot`.

    Keys and hops are in order of time. Raises ValueError with the beat if the score does not close or lifts a foot that
    cannot be lifted.
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
        """Positions of the feet at the start."""
        return {"left": self.left_foot, "right": self.right_foot}

    def list_footfalls(self) -> list[Step | Hop]:
        """Return steps and hops in order of landing."""
        return sorted([*self.steps, *self.hops], key=lambda footfall: footfall.beat)

    @property
    def seconds_per_beat(self) -> float:
        """Seconds per beat."""
        return 60.0 / self.beats_per_minute

    @property
    def duration(self) -> float:
        """Duration in seconds."""
        return self.beat_count * self.seconds_per_beat
