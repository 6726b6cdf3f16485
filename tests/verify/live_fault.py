"""Faults during a live performance: the owner of the stage, NATS or the capture command is killed."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bunraku.playout.block_store import Pose
from tests.capture.capture_process import BUNRAKU
from tests.e2e.test_live import angle, decode, sending, wait_for_motion
from tests.verify.result import FaultResult
from tests.verify.scenario import MAX_SILENCE_S, Scenario

TARGETS = ("owner", "nats")
PERFORMED_S = 3.0
"""Duration of the performance before and after a fault, seconds."""
MAX_LOST_S = 1.0
"""Seconds of a performance that a killed server may lose, beside those in which its viewers see nothing new."""
TOLERANCE_S = 0.25
MAX_ANGLE_RAD = 0.1
"""Largest angle of a joint between a sent pose and the archived one."""
RECONNECT_S = 30.0
"""Time in which a performer may come back, seconds."""


async def kill_during_performance(scenario: Scenario, target: str, rounds: int) -> FaultResult:
    """Kill one of `TARGETS` with `kill -9` while a performer is live beside the dance."""
    result = FaultResult(f"live, kill -9 {target}")
    for _ in range(rounds):
        sent: dict[int, Pose] = {}
        performer = scenario.client.perform(name="Aiko", session=scenario.session)
        async with performer, sending(performer, sent):
            violations = await _perform(scenario)
            service, replica = ("nats", 1) if target == "nats" else ("session", await scenario.find_owner_replica())
            began = time.monotonic()
            await scenario.stack.kill(service, replica)
            # give the performer time to detect the loss
            await asyncio.sleep(1.0)
            violations += await _perform(scenario)
            gap_s = max(viewer.longest_live_gap_s(began) for viewer in scenario.viewers)
        await wait_for_motion(scenario.client, performer.motion)
        scenario.acknowledged.append(performer.motion)
        lost_s = _count_lost_seconds(await decode(scenario.client, performer.motion), sent)
        if gap_s > MAX_SILENCE_S:
            violations.append(f"viewers saw nothing new of the performer for {gap_s:.1f} s")
        if lost_s > gap_s + MAX_LOST_S + TOLERANCE_S:
            violations.append(f"{lost_s:.1f} s are not in the motion, with a gap of {gap_s:.1f} s")
        await scenario.stack.wait_until_healthy()
        violations += [f"lost: {one}" for one in await scenario.find_lost_motions()]
        result.add_round({"live_s": gap_s, "not_kept_s": lost_s}, *violations)
    return result


async def kill_capture(scenario: Scenario, clip: Path, rounds: int) -> FaultResult:
    """Kill `bunraku capture` with `kill -9`; its performance must end by itself and become a motion."""
    result = FaultResult("live, kill -9 capture")
    for _ in range(rounds):
        process = await asyncio.create_subprocess_exec(
            *(BUNRAKU, "capture", "bvh", clip, "--loop", "--server", scenario.stack.url),
            *("--session", scenario.session),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.DEVNULL,
        )
        try:
            began = time.monotonic()
            violations = await _perform(scenario)
            performer = await scenario.client.performer(_live_performer(scenario) or "")
            shown_s = time.monotonic() - began
        finally:
            process.kill()
            await process.wait()
        killed = time.monotonic()
        if not await _wait_until(lambda: _live_performer(scenario) is None, RECONNECT_S + 2 * MAX_SILENCE_S):
            violations.append("the performance did not end by itself")
        ended_s = time.monotonic() - killed
        motion = await wait_for_motion(scenario.client, str(performer["motion"]))
        scenario.acknowledged.append(str(motion["id"]))
        duration_s = float(str(motion["duration"]))
        if duration_s < PERFORMED_S - MAX_LOST_S:
            violations.append(f"the motion has {duration_s:.1f} s of {shown_s:.1f} s")
        violations += [f"lost: {one}" for one in await scenario.find_lost_motions()]
        result.add_round({"ended_s": ended_s, "archived_s": time.monotonic() - killed - ended_s}, *violations)
    return result


async def _perform(scenario: Scenario) -> list[str]:
    """Let both viewers see the performer for `PERFORMED_S`; return what was violated."""
    since = time.monotonic()

    def has_shown() -> bool:
        times = [[at for at in viewer.live_times if at > since] for viewer in scenario.viewers]
        return all(found and found[-1] - found[0] >= PERFORMED_S for found in times)

    return [] if await _wait_until(has_shown, 30.0) else ["viewers do not see the performer"]


async def _wait_until(condition: Callable[[], bool], seconds: float) -> bool:
    """Wait until a condition is true; return whether it is, after `seconds` at most."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        await asyncio.sleep(0.05)
    return True


def _live_performer(scenario: Scenario) -> str | None:
    """Return the id of the live performer that a viewer is told of, None if there is none."""
    presences = [viewer.presence for viewer in scenario.viewers]
    return next((str(one["id"]) for presence in presences if presence for one in presence.live or ()), None)


def _count_lost_seconds(archived: list[Pose], sent: dict[int, Pose]) -> float:
    """Return for how many seconds of a performance the archived motion, at 60 Hz, differs from what was sent."""
    times = np.array(sorted(sent))
    step_us = 1e6 / 60
    kept = {round((at - times[0]) / step_us): pose for at, pose in sent.items()}
    differing = sum(
        number >= len(archived) or angle(archived[number][1], pose[1]) > MAX_ANGLE_RAD for number, pose in kept.items()
    )
    return float(differing) / 60
