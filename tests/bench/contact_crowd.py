"""Crowds that pull one limb: part `crowd` of `make bench-contact`. Clients are simulated; the rest is the real code.

A crowd of 1,000 at four stream replicas follows a moving wish, each member with a scatter of its own; 10 % of it are
saboteurs, who from the second second on pull to one end of the reach. Figures:

    crowd_saboteur_share  largest displacement of the limb against the same crowd without them, as a share of the
                          distance from there to where the saboteurs pull, under trimmed mean; `_median` under median
    crowd_replay_exact    whether a second run gives the same frames, and the log every frame
    crowd_cost_ratio      processor time of the owner's stage for a crowd of 10,000 at four replicas by that for a crowd
                          of 10 there; `crowd_cost_us` per tick, with 10,000; `crowd_replica_ms` of a replica per second
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

import msgpack
import numpy as np

from bunraku.codec import motion_decoder
from bunraku.codec.container import StoredMotion
from bunraku.marionette.crowd.pulls import CrowdPulls
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import Vector
from bunraku.messaging.bus import MemoryBus
from bunraku.playout import timeline
from bunraku.playout.overlay_buffer import pack_overlay
from bunraku.playout.session_log import SessionLog
from bunraku.session.control.crowd_control import CROWD, CrowdControl
from bunraku.session.session_start import Fittings, SessionStart
from bunraku.session.stage import Stage
from tests.marionette.bond.bonded_stage import FRAME_INTERVAL_US, BondedStage, random_dance
from tests.session.joined_stage import stored_motion
from tests.virtual_time import START_US, run_in_virtual_time

REPLICAS = 4
SUMMARY_INTERVAL_US = 50_000
MEMBERS, SABOTEURS = 1_000, 100
SABOTAGE_US = 1_000_000
SECONDS = 4.0
SABOTEURS_WISH: Vector = (-1.0, 0.0, 0.0)
LEFT_HAND = 0
COST_SECONDS = 8
REPEATS = 3


class Crowd:
    """Members at several replicas, determined by a seed; the first of them can be saboteurs."""

    def __init__(self, members: int, saboteurs: int = 0, without: int = 0, seed: int = 3) -> None:
        """The first `without` members do not pull at all."""
        random = np.random.default_rng(seed)
        self._scatter = random.normal(scale=0.08, size=(members, 3))
        self._keys = random.integers(0, 1 << 63, members).tolist()
        self._saboteurs, self._without = saboteurs, without
        self._replicas = [CrowdPulls(LEFT_HAND) for _ in range(REPLICAS)]

    def summaries(self, now: int) -> list[bytes]:
        """Return the messages of all replicas after each member has pulled."""
        seconds = (now - START_US) * 1e-6
        wish = np.array([0.35, 0.25 * np.sin(1.7 * seconds), 0.45 + 0.15 * np.sin(2.3 * seconds)])
        targets = (self._scatter + wish).tolist()
        for n in range(self._without, len(targets)):
            is_saboteur = n < self._saboteurs and now - START_US >= SABOTAGE_US
            x, y, z = SABOTEURS_WISH if is_saboteur else targets[n]
            self._replicas[n % REPLICAS].pull(self._keys[n], (x, y, z), now)
        return [
            msgpack.packb([str(n), LEFT_HAND, now, pulls.summarise(now).pack()])
            for n, pulls in enumerate(self._replicas)
        ]


def move_limb(crowd: Crowd, policy: str) -> BondedStage:
    """Return a stage whose left hand the crowd has moved for `SECONDS`."""
    frames = round(SECONDS * 1e6 / FRAME_INTERVAL_US)
    stage = BondedStage([random_dance(frames, np.random.default_rng(1), (0.0, 0.9, 0.0), 0.0)], (0, 1))
    control = CrowdControl(stage.ownership, lambda *_: None)
    control.set_policies({LEFT_HAND: policy}, START_US)
    next_summary = START_US
    for frame in range(frames):
        now = START_US + frame * FRAME_INTERVAL_US
        if now >= next_summary:
            for message in crowd.summaries(now):
                control.receive(message, now)
            next_summary += SUMMARY_INTERVAL_US
        control.apply(now)
        stage.show(frame, now)
    assert stage.ownership.holders()[LEFT_HAND] == CROWD
    return stage


def measure_sabotage(policy: str) -> tuple[float, bool]:
    """Return the share of what the saboteurs ask for by which they move the limb, and whether a replay is exact."""
    moved, clean = move_limb(Crowd(MEMBERS, SABOTEURS), policy), move_limb(Crowd(MEMBERS, without=SABOTEURS), policy)
    hand, share = clean.hands[0], 0.0
    for frame, position in enumerate(hand.positions):
        if frame * FRAME_INTERVAL_US < SABOTAGE_US:
            continue
        shoulder, turn = hand.frames[frame]
        wish = vector.scale(vector.rotate(turn, SABOTEURS_WISH), hand.rig.arm_length_m)
        asked = vector.length(vector.subtract(vector.add(shoulder, wish), position))
        share = max(share, vector.length(vector.subtract(moved.hands[0].positions[frame], position)) / asked)
    again = move_limb(Crowd(MEMBERS, SABOTEURS), policy)
    return share, again.overlays == moved.overlays and _is_logged(moved)


def _is_logged(stage: BondedStage) -> bool:
    log = SessionLog()
    messages = [
        pack_overlay(n, n * FRAME_INTERVAL_US, [overlay]) for n, overlay in enumerate(stage.overlays) if overlay
    ]
    for number, message in enumerate(messages):
        log.add_message(number * FRAME_INTERVAL_US, message)
    return [message.pack() for message in SessionLog.unpack(log.pack()).messages()] == messages


def _owner_seconds(rounds: list[list[bytes]], motion: StoredMotion) -> float:
    """Return the processor time of a stage that receives these summaries, one round per `SUMMARY_INTERVAL_US`."""
    used: list[float] = []

    async def run(clock: Callable[[], int]) -> None:
        bus = MemoryBus()
        state = timeline.start(motion.id, motion.first_track.duration_us, clock())
        begin = time.process_time()
        stage = Stage(
            SessionStart("s", motion, state, state.clock, fittings=Fittings({LEFT_HAND: "trimmed mean"}, {})),
            bus,
            clock,
        )
        for messages in rounds:
            for message in messages:
                bus.publish("session.s.crowd", message)
            await asyncio.sleep(SUMMARY_INTERVAL_US * 1e-6)
        assert stage.holders[LEFT_HAND] == CROWD
        used.append(time.process_time() - begin)
        await stage.close()

    run_in_virtual_time(run)
    return used[0]


def measure_cost(members: tuple[int, int] = (10, 10_000), seconds: int = COST_SECONDS) -> dict[str, float]:
    """Return the owner's cost of both crowds, the least of `REPEATS` runs each, and that of a replica."""
    motion_decoder.warm_up()
    motion, times = stored_motion("one", 5), range(0, seconds * 1_000_000, SUMMARY_INTERVAL_US)
    rounds: list[list[list[bytes]]] = []
    for count in members:
        crowd = Crowd(count)
        begin = time.process_time()
        rounds.append([crowd.summaries(START_US + at) for at in times])
        replica_s = (time.process_time() - begin) / REPLICAS / seconds
    _owner_seconds(rounds[0][:40], motion)
    used = [[_owner_seconds(one, motion) for one in rounds] for _ in range(REPEATS)]
    few, many = (min(run[n] for run in used) for n in (0, 1))
    ticks = seconds * 1e6 / (2 * FRAME_INTERVAL_US)
    return {
        "crowd_cost_ratio": round(many / few, 3),
        "crowd_cost_us": round(many / ticks * 1e6),
        "crowd_replica_ms": round(replica_s * 1e3),
    }


def measure_crowd() -> dict[str, Any]:
    """Return the figures of this module; prints a table."""
    shares = {policy: measure_sabotage(policy) for policy in ("trimmed mean", "median")}
    print(f"{'policy':<14}{'saboteurs move':>16}  replay")
    for policy, (share, is_exact) in shares.items():
        print(f"{policy:<14}{share:>15.2%}  {'exact' if is_exact else 'differs'}")
    return {
        "crowd_saboteur_share": round(shares["trimmed mean"][0], 4),
        "crowd_saboteur_share_median": round(shares["median"][0], 4),
        "crowd_replay_exact": all(is_exact for _, is_exact in shares.values()),
        **measure_cost(),
    }
