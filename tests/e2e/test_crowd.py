"""Forty phones that move one arm together over real connections, as at an exhibition."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

from bunraku.client import Client, Viewer
from bunraku.motion.skeleton import joint_and_tip_positions
from bunraku.playout.block_store import Pose
from tests.time_limit import HANG_TIMEOUT_S

PHONES, SABOTEURS = 40, 4
LEFT_HAND, LEFT_TIP = 0, 19
PULL_INTERVAL_S = 0.1
"""Longer than that of a page, as one process runs all phones."""
SETTLED_ROUNDS = 8
Place = tuple[float, float, float]
UP: Place = (0.2, 0.8, 0.4)
DOWN: Place = (0.2, -0.8, 0.1)


class Exhibition:
    """Session with a paused dance, and phones of which each pulls its left hand to a place."""

    def __init__(self, client: Client, session: str) -> None:
        self.phones = [Viewer(client.socket_url(f"/v1/sessions/{session}/stream?rate=0")) for _ in range(PHONES)]
        self.places = [UP] * PHONES
        self.tip_height_m = float("nan")
        self._client, self._session = client, session

    @asynccontextmanager
    async def connected(self) -> AsyncIterator[None]:
        """Connect all phones; the first one shows what it receives."""
        first, *others = self.phones
        watching = [asyncio.create_task(first.watch(10 * HANG_TIMEOUT_S, self._measure))]
        watching += [asyncio.create_task(phone.watch(10 * HANG_TIMEOUT_S, frame_interval=1.0)) for phone in others]
        try:
            yield
        finally:
            for task in watching:
                task.cancel()
            await asyncio.gather(*watching, return_exceptions=True)

    async def set_policy(self, policy: str | None) -> None:
        """Open the hand with a merge policy; None closes it."""
        await self._client.edit_session(self._session, crowd={"left_hand": policy})

    async def pull_until(self, condition: Callable[[], bool]) -> None:
        """Pull with all phones until the condition is met."""
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while not condition():
                for phone, place in zip(self.phones, self.places, strict=True):
                    await phone.pull(LEFT_HAND, *place)
                await asyncio.sleep(PULL_INTERVAL_S)

    async def pull_until_settled(self) -> float:
        """Pull until the hand rests, and return the height of its tip in metres."""
        heights: list[float] = []

        def is_settled() -> bool:
            heights.append(self.tip_height_m)
            newest = heights[-SETTLED_ROUNDS:]
            return len(newest) == SETTLED_ROUNDS and max(newest) - min(newest) < 1e-3

        await self.pull_until(is_settled)
        return heights[-1]

    def count_pulls(self) -> int:
        """Return the number of pulls that the last phone was told."""
        pulls = self.phones[-1].crowd_pulls.get(LEFT_HAND)
        return 0 if pulls is None else pulls.count

    def holder(self) -> str | None:
        """Return the holder of the hand."""
        presence = self.phones[-1].presence
        return None if presence is None else presence.limbs[LEFT_HAND]

    def turns(self) -> list[int]:
        """Return the phones whose turn it is."""
        return [n for n, phone in enumerate(self.phones) if LEFT_HAND in phone.crowd_turns]

    def votes(self) -> list[int] | None:
        """Return the votes that the last phone was told."""
        pulls = self.phones[-1].crowd_pulls.get(LEFT_HAND)
        return None if pulls is None else pulls.votes

    def _measure(self, _: int, pose: Pose) -> None:
        track = self.phones[0].track
        if track is not None:
            self.tip_height_m = float(joint_and_tip_positions(track.figure, *pose)[LEFT_TIP][1])


async def test_forty_phones_move_one_arm_under_every_policy(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        motion = (await client.upload(clip_file))["id"]
        session = (await client.open_session(motion, playing=False))["id"]
        exhibition = Exhibition(client, session)
        async with exhibition.connected():
            await exhibition.set_policy("trimmed mean")
            await exhibition.pull_until(lambda: exhibition.count_pulls() == PHONES)
            up = await exhibition.pull_until_settled()
            exhibition.places = [DOWN] * PHONES
            await exhibition.pull_until(lambda: exhibition.tip_height_m < up - 0.2)
            down = await exhibition.pull_until_settled()
            assert down < up - 0.4
            exhibition.places = [DOWN] * SABOTEURS + [UP] * (PHONES - SABOTEURS)
            await exhibition.pull_until(lambda: exhibition.tip_height_m > (up + down) / 2)
            assert abs(await exhibition.pull_until_settled() - up) < 0.02

            await exhibition.set_policy("vote")
            await exhibition.pull_until(lambda: exhibition.votes() == [PHONES - SABOTEURS, 0, 0, SABOTEURS, 0])

            await exhibition.set_policy("turns")
            await exhibition.pull_until(lambda: len(exhibition.turns()) == 1)
            first = exhibition.turns()
            # the messages about a change of turns come on two connections
            await exhibition.pull_until(lambda: exhibition.turns() != first and len(exhibition.turns()) == 1)

            await exhibition.set_policy(None)
            await exhibition.pull_until(lambda: exhibition.holder() is None and exhibition.count_pulls() == 0)
            await exhibition.pull_until(lambda: exhibition.turns() == [])
