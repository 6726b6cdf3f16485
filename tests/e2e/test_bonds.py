"""A teacher who leads a pupil by the hand, stored and live, as a viewer sees it over real connections."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

import numpy as np

from bunraku.client import Client, Puppeteer, Viewer
from bunraku.motion.skeleton import joint_and_tip_positions
from bunraku.playout.block_store import Pose
from tests.e2e.test_live import sending
from tests.time_limit import HANG_TIMEOUT_S

LEFT_TIP, RIGHT_TIP = 19, 20
TEACHER_HAND, PUPIL_HAND = 0, 5
"""Left hand of the first performer, right hand of the second, who stands at its left."""
HALF_DISTANCE_M = 0.45
MAX_APART_M, MIN_PARTED_M = 0.01, 0.1
MIN_LED_M = 0.1
"""Movement of the pupil's hand, in height."""
FRAMES = 60
INPUT_INTERVAL_S = 0.05


class TipDistance:
    """Distances of the bonded tips, and heights of the pupil's one, in the frames that a viewer shows."""

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self.metres: list[float] = []
        self.heights: list[float] = []

    def measure(self, reference: int, _: Pose) -> None:
        tips = [self._tip(reference, performer, tip) for performer, tip in ((0, LEFT_TIP), (1, RIGHT_TIP))]
        if tips[0] is not None and tips[1] is not None:
            self.metres.append(float(np.linalg.norm(tips[0] - tips[1])))
            self.heights.append(float(tips[1][1]))

    def is_led(self) -> bool:
        """Return whether the hands stayed together while they moved, in the median of the last frames.

        The session solves them to less than 5 mm; what is shown between two overlays may be further apart.
        """
        metres, heights = self.metres[-FRAMES:], self.heights[-FRAMES:]
        return len(metres) == FRAMES and float(np.median(metres)) <= MAX_APART_M and np.ptp(heights) >= MIN_LED_M

    def _tip(self, reference: int, performer: int, tip: int) -> np.ndarray | None:
        tracks, pose = self._viewer.performers, self._viewer.pose_at(reference, performer)
        if pose is None or (track := tracks[performer]) is None:
            return None
        return np.asarray(joint_and_tip_positions(track.figure, *pose)[tip])


@asynccontextmanager
async def measuring(client: Client, session: str) -> AsyncIterator[TipDistance]:
    viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"))
    distance = TipDistance(viewer)
    watching = asyncio.create_task(viewer.watch(4 * HANG_TIMEOUT_S, distance.measure))
    try:
        yield distance
    finally:
        watching.cancel()
        await asyncio.gather(watching, return_exceptions=True)


async def lead_by_the_hand(client: Client, session: str) -> None:
    """Bond the pupil's free hand to the teacher's, move it, and end the bond; check what a viewer sees."""
    async with (
        measuring(client, session) as distance,
        Puppeteer(client, session, "teacher") as teacher,
        asyncio.timeout(HANG_TIMEOUT_S),
    ):
        await teacher.claim(TEACHER_HAND)
        await teacher.bond(TEACHER_HAND, PUPIL_HAND)

        async def move() -> None:
            swing = math.sin(3.0 * asyncio.get_running_loop().time())
            await teacher.target(TEACHER_HAND, 0.55, -0.1 + 0.25 * swing, 0.35)
            await asyncio.sleep(INPUT_INTERVAL_S)

        while not distance.is_led():
            await move()
        await teacher.unbond(TEACHER_HAND, PUPIL_HAND)
        # the pupil's hand returns to its motion
        while distance.metres[-1] < MIN_PARTED_M:
            await move()
        assert teacher.bonds == ()


async def test_teacher_leads_the_pupil_of_a_stored_motion(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        motion = (await client.upload(clip_file))["id"]
        places = [[-HALF_DISTANCE_M, 0.0, 0.0], [HALF_DISTANCE_M, 0.0, 0.0]]
        pair = await client.add_performers(motion, [motion], places)
        await lead_by_the_hand(client, (await client.open_session(pair["id"]))["id"])


async def test_teacher_leads_a_live_pupil(server: str) -> None:
    async with Client(server) as client, AsyncExitStack() as stack:
        session: str | None = None
        for side in (-1, 1):
            place = (side * HALF_DISTANCE_M, 0.0, 0.0)
            performer = await stack.enter_async_context(client.perform(session=session, place=place))
            await stack.enter_async_context(sending(performer))
            session = performer.session
        assert session is not None
        await lead_by_the_hand(client, session)
