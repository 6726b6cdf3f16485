"""How smoothly limbs are taken, pulled and let go: the part of `make bench-ik` that needs the whole marionette.

All lengths are arm lengths and all places are in the shoulder's frame, at 60 frames a second.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import islice
from math import cos, pi, sin
from typing import NamedTuple

import numpy as np

from bunraku.marionette import shoulder as limit
from bunraku.marionette import vector
from bunraku.marionette.bodies import BODIES
from bunraku.marionette.elbow import Elbow, elevation
from bunraku.marionette.limbs import ArmRig, Limb
from bunraku.marionette.merge import Marionette, apply
from bunraku.marionette.ownership import Grant, Input
from bunraku.marionette.proportions import Proportions
from bunraku.marionette.pulled import LEAST_REACH, MOST_REACH
from bunraku.marionette.vector import Vector
from bunraku.motion import choreography
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure, standard_figure

FRAME = 16_667
SPEED = 0.5
"""Of a hand, arm lengths per second."""
UP = (0.0, 1.0, 0.0)
Path = list[Vector]


def line(begin: Vector, end: Vector, speed: float = SPEED) -> Path:
    """A hand's way straight from one place to another and back, a place for each frame."""
    way = vector.subtract(end, begin)
    steps = max(int(vector.length(way) * 60.0 / speed), 1)
    there = [vector.add(begin, vector.scale(way, k / steps)) for k in range(steps + 1)]
    return there + there[-2::-1]


def circle(radius: float, normal: Vector, speed: float, turns: float = 2.0, away: float = 0.0) -> Path:
    """A hand's way round the shoulder, in the plane of the unit `normal`, `away` from the shoulder along it."""
    one = vector.across(normal)
    other = vector.cross(normal, one)
    middle = vector.scale(normal, away)
    steps = int(turns * 2.0 * pi * radius * 60.0 / speed)
    angles = [turns * 2.0 * pi * k / steps for k in range(steps)]
    return [
        vector.add(middle, vector.add(vector.scale(one, radius * cos(a)), vector.scale(other, radius * sin(a))))
        for a in angles
    ]


def slow_paths(inner: float) -> Iterator[Path]:
    """Ways at `SPEED` through all of the reachable shell: over and under the shoulder, in and out, across, around."""
    random = np.random.default_rng(4)
    for height in (-0.95, -0.6, -0.3, 0.3, 0.6, 0.9):
        for off in (0.0, 1e-9, 1e-6, 1e-3, 0.01, 0.03, 0.1):
            for heading in np.linspace(0.0, pi, 4, endpoint=False):
                ahead, side = (sin(heading), 0.0, cos(heading)), (cos(heading), 0.0, -sin(heading))
                half = 0.9 * (1.0 - height * height) ** 0.5
                middle = vector.add((0.0, height, 0.0), vector.scale(side, off))
                yield line(
                    vector.subtract(middle, vector.scale(ahead, half)), vector.add(middle, vector.scale(ahead, half))
                )
    for _ in range(60):
        direction = vector.unit(_random(random), UP)
        yield line(vector.scale(direction, MOST_REACH), vector.scale(direction, inner))
        yield circle(random.uniform(0.3, 0.95), direction, SPEED)
    while True:
        begin, end = (vector.scale(vector.unit(_random(random), UP), random.uniform(inner, MOST_REACH)) for _ in "ab")
        yield line(begin, end)


def elbow_steps(rig: ArmRig, path: Path) -> tuple[float, float, float]:
    """The farthest that the elbow goes in a frame, and that the tip is from where it was asked to be."""
    inner = max(rig.arm.inner, LEAST_REACH)
    elbow = Elbow(rig.arm, rig.shoulder)
    farthest = error = 0.0
    depth = -pi
    last: Vector | None = None
    for place in path:
        reach = vector.length(place)
        if reach < inner or reach > MOST_REACH:
            place = vector.scale(rig.direction(place), min(max(reach, inner), MOST_REACH))
            if reach < inner:
                # not a place that a hand can be: the way goes on beyond it
                last = None
                elbow.forget()
                continue
        direction = rig.direction(place)
        if not elbow.known:
            reach = vector.length(place)
            normal = (
                vector.cross(direction, UP) if vector.length(vector.cross(direction, UP)) > 1e-9 else (1.0, 0.0, 0.0)
            )
            bent = rig.arm.close(reach, 0.0, rig.arm.bend(reach, elevation(direction, UP)))
            elbow.begin(direction, normal, -bent[0])
            for _ in range(120):
                elbow.follow(direction, reach, UP, FRAME * 1e-6)
        tip, normal, bend = elbow.follow(direction, vector.length(place), UP, FRAME * 1e-6)
        shoulder, *others = rig.bend(vector.length(tip), bend)
        places = rig.places((vector.multiply(rig.chord(rig.direction(tip), normal), shoulder), others[0], others[1]))
        here, there = (vector.scale(one, 1.0 / rig.scale) for one in (places[0], places[2]))
        depth = max(depth, limit.depth(rig.shoulder, rig.direction(here)))
        error = max(error, vector.length(vector.subtract(there, place)))
        if last is not None:
            farthest = max(farthest, vector.length(vector.subtract(here, last)))
        last = here
    return farthest, error, depth


class Handover(NamedTuple):
    """One hand taken and let go: its greatest acceleration while it is held and on its way back, and that of the
    dance's own hand meanwhile; and milliseconds from the grant until it is within a hundredth of where its puppeteer
    wants it, and from the release until it is the dance's."""

    taking: float
    returning: float
    dancing: float
    taken_ms: float
    back_ms: float


def handover(limb: Limb, figure: Figure, poses: Array, begin: int, away: Vector, phase: int) -> Handover:
    """Takes the hand in frame `begin` of a dance (n, 18, 4), `phase` µs after it, asks for the place `away` from where
    the dance has it, holds for half a second, and lets go."""
    rig, puppet = ArmRig(figure, limb), Marionette(figure)
    own = [rig.target(rig.dance(pose)) for pose in poses[begin - 3 : begin + 80].tolist()]
    times = [(begin - 3 + k) * FRAME for k in range(len(own))]
    hands = own[:4]
    granted = times[3] + phase
    puppet.see(poses[begin - 1], times[2])
    puppet.see(poses[begin], times[3])
    grant = puppet.claim(limb, "one", granted)
    assert isinstance(grant, Grant)
    target = vector.add(own[3], away)
    taken = back = released = 0
    home = 36
    for k in range(4, len(own)):
        now = times[k]
        if k == 34:
            puppet.release(limb, "one", grant.epoch, now - FRAME + phase)
            released = now - FRAME + phase
        elif k < 34:
            puppet.input("one", Input(limb, 1, grant.epoch, k, now - FRAME + phase, target), now - FRAME + phase)
        merged = apply(poses[begin - 3 + k], puppet.overlay(poses[begin - 3 + k], now))
        hands.append(rig.target(rig.dance(merged.tolist())))
        if not taken and vector.length(vector.subtract(hands[-1], target)) < 0.01:
            taken = now - granted - round(FRAME * (1.0 - _share(hands[-2], hands[-1], target)))
        off = vector.length(vector.subtract(hands[-1], own[k]))
        if released and off > 1e-4:
            back, home = now + FRAME - released, k + 2
    speeding = np.linalg.norm(_accelerations(hands[:home]), axis=1)
    dancing = np.linalg.norm(_accelerations(own[:home]), axis=1)
    return Handover(
        float(speeding[2:32].max()),
        float(speeding[32:].max()),
        float(dancing[32:].max()),
        taken / 1e3 or math.inf,
        back / 1e3,
    )


def _share(begin: Vector, end: Vector, target: Vector) -> float:
    """When between two frames, of which viewers see all that is between, a hand came within a hundredth of a target."""
    for step in range(21):
        place = vector.add(begin, vector.scale(vector.subtract(end, begin), step / 20.0))
        if vector.length(vector.subtract(place, target)) < 0.01:
            return step / 20.0
    return 1.0


def _accelerations(places: list[Vector]) -> Array:
    second: Array = np.diff(np.array(places), 2, axis=0) / (FRAME * 1e-6) ** 2
    return second


def handovers(count: int, distance: float) -> list[Handover]:
    """Hands taken in the demo's dance at random instants, the wanted place `distance` away in a random direction."""
    motion = choreography.dance()
    random = np.random.default_rng(7)
    found: list[Handover] = []
    rigs = [ArmRig(motion.figure, limb) for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND)]
    while len(found) < count:
        limb = Limb(len(found) % 2)
        rig = rigs[limb]
        begin = int(random.integers(4, len(motion.rotations) - 90))
        way = vector.unit(_random(random), UP)
        target = vector.add(rig.target(rig.dance(motion.rotations[begin].tolist())), vector.scale(way, distance))
        if LEAST_REACH < vector.length(target) < MOST_REACH and limit.depth(rig.shoulder, rig.direction(target)) < 0.0:
            found.append(
                handover(
                    limb,
                    motion.figure,
                    motion.rotations,
                    begin,
                    vector.scale(way, distance),
                    int(random.integers(FRAME)),
                )
            )
    return found


def _random(random: np.random.Generator) -> Vector:
    x, y, z = random.normal(size=3).tolist()
    return (x, y, z)


def figure_with(proportions: Proportions) -> Figure:
    """The standard figure with arms of these proportions, as long as before."""
    figure = standard_figure()
    offsets, tips = figure.offsets.copy(), figure.tips.copy()
    for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND):
        _, elbow, wrist = limb.joints
        links = [offsets[elbow], offsets[wrist], tips[wrist]]
        whole = sum(float(np.linalg.norm(link)) for link in links)
        for link, share in zip(links, proportions.lengths, strict=True):
            link *= share * whole / np.linalg.norm(link)
    return Figure(offsets, tips)


def measure(paths: int = 300, hands: int = 200) -> dict[str, float]:
    """All figures of this module, with a table; some tens of seconds."""
    print(f"\n{'elbow, arm lengths a frame':<34}{'slow hand':>10}{'circles':>10}{'tip off':>10}{'in a cap':>10}")
    slow: list[float] = []
    fast: list[float] = []
    for body in BODIES:
        rig = ArmRig(figure_with(body.proportions), Limb.LEFT_HAND)
        steps = [elbow_steps(rig, path) for path in islice(slow_paths(LEAST_REACH), paths)]
        circles = [elbow_steps(rig, path) for path in fast_circles()]
        # where the shoulder lets an arm be, the tip is exact; what it does not is told apart
        exact = [error for _, error, _ in steps if error < 1e-6]
        print(
            f"{body.name:<34}{max(s for s, _, _ in steps):10.4f}{max(s for s, _, _ in circles):10.4f}"
            f"{max(exact):10.0e}{max(d for _, _, d in steps + circles):10.0e}"
            f"   tip exact on {len(exact)} of {len(steps)} ways, the others lead behind the back",
            flush=True,
        )
        slow += [step for step, _, _ in steps]
        fast += [step for step, _, _ in circles]
    print(f"\n{'hand-over':<34}{'median':>10}{'95 %':>10}{'most':>10}")
    found = np.array(handovers(hands, 0.25))
    for name, column in zip(Handover._fields, found.T, strict=True):
        median, most, all_of = np.percentile(column, (50, 95, 100))
        print(f"{name:<34}{median:10.1f}{most:10.1f}{all_of:10.1f}")
    return {
        "elbow_step_max": max(slow),
        "elbow_step_circle_max": max(fast),
        "handover_accel": float(found[:, 0].max()),
        "handover_ms": float(np.percentile(found[:, 3], 95)),
        "handover_ms_max": float(found[:, 3].max()),
        "handback_accel_p95": float(np.percentile(found[:, 1], 95)),
        "handback_ms": float(found[:, 4].max()),
    }


def fast_circles() -> Iterator[Path]:
    """Round the shoulder at two arm lengths a second, level, upright and aslant."""
    for radius in (0.5, 0.6, 0.7, 0.8, 0.9):
        for normal in (
            (0.0, 1.0, 0.0),
            (1.0, 0.0, 0.0),
            (0.0, 0.0, 1.0),
            (0.6, 0.8, 0.0),
            (0.0, 0.6, 0.8),
            (0.6, 0.0, 0.8),
        ):
            yield circle(radius, normal, 4.0 * SPEED)


if __name__ == "__main__":
    print(json.dumps(measure()))
