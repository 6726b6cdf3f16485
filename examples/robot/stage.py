"""Robot on the stage of a session: follows a performer through the SDK, and dances beside it as a live performer."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

from bunraku.client import Client, Performer, Viewer
from bunraku.motion.skeleton import Figure
from examples.robot.simulation import Pose, Robot

SHOW_FPS = 60.0
FIGURE_TIMEOUT_S = 60.0
"""Time for the first pose of the performer to arrive."""
MAX_SLOWDOWN = 3.0
"""Duration of a run at most, relative to the simulated time that was asked for: a busy machine leaves out frames."""


class StageError(Exception):
    """Session or performer that the robot cannot follow; the message has the reason."""


class Follower:
    """Follower of a performer: simulates the robot for each frame of a viewer."""

    def __init__(
        self, viewer: Viewer, performer: int, *, free: bool = False, on_fall: Callable[[float], None] | None = None
    ) -> None:
        """`on_fall` receives the simulated time of each fall in seconds."""
        self.robot: Robot | None = None
        self.ready = asyncio.Event()
        """Set once the performer's figure is known and the robot is built."""
        self.moved = asyncio.Event()
        """Set after each frame of the robot."""
        self._progress = asyncio.Event()
        self._viewer, self._performer, self._free, self._on_fall = viewer, performer, free, on_fall
        self._last_us: int | None = None

    def on_frame(self, reference_us: int, _: Pose) -> None:
        """Simulate up to the time of a frame."""
        pose = self._viewer.pose_at(reference_us, self._performer)
        if pose is None:
            return
        figure = self._figure()
        if self.robot is None:
            if figure is None:
                return
            self.robot = Robot(figure, free=self._free)
            self.ready.set()
        elapsed = 0.0 if self._last_us is None else (reference_us - self._last_us) / 1e6
        self._last_us = reference_us
        if self.robot.follow(pose, elapsed) and self._on_fall is not None:
            self._on_fall(self.robot.measurement.simulated_s)
        self.moved.set()
        self._progress.set()

    async def simulated(self, seconds: float) -> None:
        """Wait until the robot has been simulated for `seconds`: pauses of a busy machine do not count."""
        while self.robot is None or self.robot.measurement.simulated_s < seconds:
            self._progress.clear()
            await self._progress.wait()

    def _figure(self) -> Figure | None:
        performers = self._viewer.performers
        track = performers[self._performer] if self._performer < len(performers) else None
        return track.figure if track is not None else None


async def run_robot(
    client: Client,
    session: str,
    seconds: float,
    *,
    performer: int = 0,
    free: bool = False,
    beside: float | None = None,
    on_fall: Callable[[float], None] | None = None,
    stop: asyncio.Event | None = None,
) -> Robot:
    """Let a robot follow a performer of a session until `seconds` are simulated, or `stop` is set, and return it.

    With `beside`, the robot is a live performer of the session, that many metres to the performer's left. Raise
    `StageError` if the performer does not appear, `StreamEnded` if the session ends, `ServerProblem` if the server
    refuses.
    """
    viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"), token=client.token)
    follower = Follower(viewer, performer, free=free, on_fall=on_fall)
    watching = asyncio.create_task(viewer.watch(MAX_SLOWDOWN * seconds + FIGURE_TIMEOUT_S, follower.on_frame))
    try:
        waiting = asyncio.create_task(follower.ready.wait())
        await asyncio.wait((watching, waiting), timeout=FIGURE_TIMEOUT_S, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        if watching.done():
            watching.result()
        if follower.robot is None:
            raise StageError(f"Performer {performer} of session {session} has no pose. Is a motion on its stage?")
        work: list[Coroutine[Any, Any, Any]] = [follower.simulated(seconds)]
        if beside is not None:
            work.append(_show(client, session, follower, beside))
        if stop is not None:
            work.append(stop.wait())
        await _until_one_ends(watching, *(asyncio.create_task(coroutine) for coroutine in work))
    finally:
        watching.cancel()
        await asyncio.gather(watching, return_exceptions=True)
    return follower.robot


async def _until_one_ends(*tasks: asyncio.Task[Any]) -> None:
    """Wait until one of the tasks ends, cancel the others, and raise the error of the one that ended."""
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _show(client: Client, session: str, follower: Follower, beside: float) -> None:
    """Send the robot's pose to the session after each frame, until cancelled."""
    assert follower.robot is not None
    performing: Performer = client.perform(
        follower.robot.figure, name="Robot", session=session, fps=SHOW_FPS, place=(beside, 0.0, 0.0)
    )
    async with performing as shown:
        while True:
            await follower.moved.wait()
            follower.moved.clear()
            await shown.frame(follower.robot.pose)
