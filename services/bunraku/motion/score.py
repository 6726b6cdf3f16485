"""How a dance is written down: poses at beats, steps that land on beats, hops. A score holds no numbers per frame.

Places on the stage are metres from its centre, x to the puppet's left when it faces the audience, z towards the audience.
Angles are degrees. A beat is counted from 0 at the start of the dance.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

Side = Literal["left", "right"]


@dataclass(frozen=True, slots=True)
class Arm:
    """Where one arm is, the same numbers for either side.

    `wrist` is the wrist from the shoulder as (out, up, forward) of the chest, in lengths of the hanging arm; `elbow` the
    direction (out, up, forward) in which the elbow points; `turn` degrees by which the palm, inwards at rest, is turned to
    the front; `bend` degrees by which the hand is bent to its palm.
    """

    wrist: tuple[float, float, float]
    elbow: tuple[float, float, float]
    turn: float = 0.0
    bend: float = 0.0


@dataclass(frozen=True, slots=True)
class Pose:
    """A shape of the body above the feet: both arms, and

    `depth` metres by which the hips sink below standing; `bow` forward, `lean` and `twist` to the left, of the trunk over
    the hips; `look`, `nod` and `tilt` of the head: to the left of the hips' facing, down, and over the left shoulder.
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

    def mirrored(self) -> Pose:
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
class Key:
    """The body comes into `pose` at `beat`, having set out `over` beats earlier.

    If it sets out before the key before is reached, it flows through that one. It starts crisply, as a puppet does, or, where
    it is `even`, as a slow sweep does.
    """

    beat: float
    pose: Pose
    over: float
    even: bool = False


@dataclass(frozen=True, slots=True)
class Place:
    """Where a foot stands: the middle of its sole (x, z) in metres, its toes `turn` degrees to the left of the audience."""

    x: float
    z: float
    turn: float = 0.0


@dataclass(frozen=True, slots=True)
class Step:
    """A foot goes to a place and lands at `beat`.

    It is `swing` beats in the air, `lift` metres high at most, and comes down within the last `fall` beats. A `stamp` comes
    down hard and is heard.
    """

    beat: float
    foot: Side
    to: Place
    swing: float = 0.5
    lift: float = 0.02
    fall: float = 0.25
    stamp: bool = False

    @property
    def lifted(self) -> float:
        """The beat at which the foot leaves the floor."""
        return self.beat - self.swing


@dataclass(frozen=True, slots=True)
class Hop:
    """Both feet leave the floor together and land at `beat` in their places, `flight` beats later."""

    beat: float
    left: Place
    right: Place
    flight: float = 0.42

    @property
    def lifted(self) -> float:
        """The beat at which the feet leave the floor."""
        return self.beat - self.flight


@dataclass(frozen=True, slots=True)
class Score:
    """A dance of `beats` beats that begins and ends in `rest`, its feet at `left` and `right`.

    Keys are in order of time, and so are steps and hops. ValueError says where a score does not close or has both feet in
    the air but in a hop.
    """

    beats_per_minute: float
    beats: int
    rest: Pose
    left: Place
    right: Place
    keys: tuple[Key, ...]
    steps: tuple[Step, ...]
    hops: tuple[Hop, ...] = field(default=())

    def __post_init__(self) -> None:
        if not self.keys or self.keys[-1].pose != self.rest or self.keys[-1].beat > self.beats:
            raise ValueError("the last key must bring the body back to the rest pose before the end, or a loop jumps")
        keys = [key.beat for key in self.keys]
        if keys != sorted(keys) or any(key.over <= 0 for key in self.keys):
            raise ValueError("keys must be in order of beats, each taking more than 0 beats")
        feet = {"left": self.left, "right": self.right}
        free = 0.0
        for footfall in self.footfalls():
            if footfall.lifted < free - 1e-9:
                raise ValueError(f"the foot that lands at beat {footfall.beat} is lifted before beat {free}, when one is in the air")
            free = footfall.beat
            feet |= {footfall.foot: footfall.to} if isinstance(footfall, Step) else {"left": footfall.left, "right": footfall.right}
        if feet != {"left": self.left, "right": self.right} or free > self.beats:
            raise ValueError(f"the feet end at {feet}, not where they began, or a loop jumps")

    def footfalls(self) -> list[Step | Hop]:
        """Steps and hops in order of landing."""
        return sorted([*self.steps, *self.hops], key=lambda footfall: footfall.beat)

    @property
    def seconds_per_beat(self) -> float:
        """Seconds from beat to beat."""
        return 60.0 / self.beats_per_minute

    @property
    def duration(self) -> float:
        """Seconds of the whole dance."""
        return self.beats * self.seconds_per_beat
