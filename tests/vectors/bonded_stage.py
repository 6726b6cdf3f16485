"""Overlays of a session with bonded hands, frame by frame (`bonded_stage.json`).

They show that the prediction of a puppeteer's own client agrees with the session. The motions are defined by a formula:
joint j of a performer has the rotation vector swing * sin(2 pi hertz t + phase), component by component, with t in
seconds, and its root rests at `root`. An event is [frame, puppeteer, action, ...]. The session receives those of `ada`,
whose client is compared, `delay` frames later: an overlay is due so much later than the inputs that it shows.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from typing import Any

import numpy as np

from bunraku.marionette.limb_target import InputKind
from bunraku.marionette.marionettes import Marionettes, StagedPose
from bunraku.marionette.ownership import LimbGrant, LimbInput, Ownership
from bunraku.motion import rotation
from bunraku.motion.placement import Placement
from bunraku.motion.skeleton import JOINT_COUNT, standard_figure
from bunraku.playout.overlay_buffer import pack_overlay

FRAME_COUNT = 200
FRAME_INTERVAL_US = 20_000
ORIGIN_US = 1_000_000
ROOT = (0.0, 0.9, 0.0)

Event = Sequence[Any]

PERFORMERS: dict[str, tuple[Placement, ...]] = {
    "own": (Placement(),),
    "led": (Placement(0.1, -0.3, 0.2), Placement(-0.1, 0.4, 3.3)),
    "other": (Placement(0.0, -0.3, 0.0), Placement(0.1, 0.35, 3.1)),
}
EVENTS: dict[str, list[Event]] = {
    # both hands of one performer: each of them leads, the bond ends, and both are released
    "own": [
        [5, "ada", "claim", 0],
        [5, "ada", "claim", 1],
        [8, "ada", "target", 0, [0.2, -0.4, 0.6]],
        [8, "ada", "target", 1, [-0.3, -0.2, 0.5]],
        [20, "ada", "bond", 0, 1],
        [35, "ada", "target", 0, [0.1, 0.2, 0.7]],
        [55, "ada", "target", 1, [-0.1, -0.5, 0.5]],
        [58, "ada", "target", 0, [0.0, 0.1, 0.6]],
        [120, "ada", "velocity", 1, [0.0, 0.6, 0.2]],
        [135, "ada", "velocity", 1, [0.0, 0.0, 0.0]],
        [150, "ada", "unbond", 0, 1],
        [165, "ada", "release", 0],
        [165, "ada", "release", 1],
    ],
    # a hand of another performer is led, and goes back to the motion
    "led": [
        [5, "ada", "claim", 0],
        [8, "ada", "target", 0, [0.1, 0.0, 0.6]],
        [20, "ada", "bond", 0, 5],
        [40, "ada", "target", 0, [0.2, 0.4, 0.5]],
        [60, "ada", "target", 0, [0.0, -0.4, 0.6]],
        [62, "ada", "target", 0, [0.05, -0.4, 0.6]],
        [100, "ada", "unbond", 0, 5],
        [150, "ada", "release", 0],
    ],
    # the led hand is claimed by another puppeteer, who pulls, too
    "other": [
        [5, "ada", "claim", 0],
        [8, "ada", "target", 0, [0.1, 0.0, 0.6]],
        [20, "ada", "bond", 0, 5],
        [45, "bo", "claim", 5],
        [70, "ada", "target", 0, [0.2, 0.3, 0.5]],
        [100, "bo", "target", 5, [-0.1, -0.3, 0.5]],
        [150, "ada", "target", 0, [0.1, 0.1, 0.65]],
    ],
}


def _poses(performer: dict[str, Any], placement: Placement) -> list[StagedPose]:
    """Return the poses of a performer on the stage."""
    t = (np.arange(FRAME_COUNT) * FRAME_INTERVAL_US * 1e-6)[:, None, None]
    swing, hertz, phase = (np.array(performer[key]) for key in ("swing", "hertz", "phase"))
    rotations = rotation.from_rotation_vector(swing * np.sin(2.0 * np.pi * hertz * t + phase))
    roots = np.tile(np.array(ROOT), (FRAME_COUNT, 1))
    return list(zip(*placement.apply(roots, rotations), strict=True))


def _apply(ownership: Ownership, event: Event, epochs: dict[int, int], now: int) -> None:
    frame, puppeteer, action, *arguments = event
    limb = arguments[0]
    if action == "claim":
        grant = ownership.claim(limb, puppeteer, now)
        assert isinstance(grant, LimbGrant)
        epochs[limb] = grant.epoch
    elif action == "release":
        assert ownership.release(limb, puppeteer, epochs[limb], now)
    elif action == "bond":
        assert ownership.bond(limb, arguments[1], puppeteer, now) is None
    elif action == "unbond":
        assert ownership.unbond(limb, arguments[1], puppeteer)
    else:
        kind = InputKind.TARGET if action == "target" else InputKind.VELOCITY
        x, y, z = arguments[1]
        ownership.apply_input(puppeteer, LimbInput(limb, kind, epochs[limb], frame, now, (x, y, z)), now)


def _make_case(name: str, seed: int, delay: int) -> dict[str, Any]:
    random = np.random.default_rng(seed)
    performers: list[dict[str, Any]] = []
    for placement in PERFORMERS[name]:
        swing = np.round(random.uniform(0.0, 0.3, (JOINT_COUNT, 3)), 3)
        swing[[0, 10]] *= 0.4
        performers.append(
            {
                "placement": list(placement),
                "root": list(ROOT),
                "swing": swing.tolist(),
                "hertz": np.round(random.uniform(0.1, 0.6, (JOINT_COUNT, 3)), 3).tolist(),
                "phase": np.round(random.uniform(0.0, 6.2, (JOINT_COUNT, 3)), 3).tolist(),
            }
        )
    dances = [_poses(each, placement) for each, placement in zip(performers, PERFORMERS[name], strict=True)]
    marionettes = Marionettes([standard_figure()] * len(dances))
    events = EVENTS[name]
    # whoever holds a limb is heard in every frame
    held: dict[int, str] = {}
    epochs: dict[int, int] = {}
    overlays: list[str] = []
    for frame in range(FRAME_COUNT):
        now = ORIGIN_US + frame * FRAME_INTERVAL_US
        for limb, puppeteer in held.items():
            marionettes.ownership.keep_alive(puppeteer, [limb], now)
        was_at_rest = marionettes.ownership.is_at_rest
        for event in events:
            if event[0] + (delay if event[1] == "ada" else 0) == frame:
                _apply(marionettes.ownership, event, epochs, now)
                if event[2] in ("claim", "release"):
                    held |= {event[3]: event[1]}
                if event[2] == "release":
                    del held[event[3]]
        if was_at_rest and not marionettes.ownership.is_at_rest:
            for before in (frame - 2, frame - 1):
                poses = [dance[before] for dance in dances]
                marionettes.observe_poses(poses, ORIGIN_US + before * FRAME_INTERVAL_US)
        overlay = marionettes.compute_overlay([dance[frame] for dance in dances], now)
        overlays.append(b64encode(pack_overlay(frame, now, [overlay])).decode())
    assert [reason for _, reason in marionettes.ownership.take_ended_bonds()] in ([], ["released"])
    return {"name": name, "delay": delay, "performers": performers, "events": events, "overlays": overlays}


def make_vectors() -> dict[str, Any]:
    """Return the content of the file."""
    return {
        "interval_us": FRAME_INTERVAL_US,
        "origin_us": ORIGIN_US,
        "cases": [_make_case("own", 1, 0), _make_case("led", 2, 0), _make_case("other", 3, 6)],
    }
