"""Invalid puppeteer input to a real server: the sender is notified, and other clients are unaffected."""

from __future__ import annotations

import asyncio
import struct
from itertools import pairwise
from pathlib import Path

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from bunraku.client.api import Client
from bunraku.client.puppeteer import Puppeteer
from bunraku.wire.messages import SUBPROTOCOL, Claim, Grant, Input, Message, Notice, Presence, Problem, Refusal, unpack
from bunraku.wire.overlay import Overlay
from tests.time_limit import HANG_TIMEOUT_S

FLOOD_INPUTS = 5_000


class RawPuppeteer:
    """Puppeteer connection without the checks of the SDK."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.sequence = 0

    async def wait_for(self, kind: type[Message]) -> Message:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while True:
                data = await self.socket.recv()
                assert isinstance(data, bytes)
                message = unpack(data)
                if isinstance(message, kind):
                    return message

    async def claim_limb(self, limb: int) -> int:
        await self.socket.send(Claim(limb).pack())
        grant = await self.wait_for(Grant)
        assert isinstance(grant, Grant)
        return grant.epoch

    def make_input(self, limb: int, epoch: int, values: tuple[float, float, float]) -> bytes:
        self.sequence += 1
        return Input(limb, Input.TARGET, epoch, self.sequence, 0, values).pack()


def connect_control(client: Client, session: str) -> connect:
    url = client.socket_url(f"/v1/sessions/{session}/control")
    return connect(url, subprotocols=[SUBPROTOCOL], compression=None)  # type: ignore[list-item]


async def open_session(client: Client, clip_file: Path) -> str:
    motion = await client.upload(clip_file)
    return str((await client.open_session(motion["id"]))["id"])


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), float("-inf")])
async def test_non_finite_input_closes_the_connection_and_frees_the_limb(
    server: str, clip_file: Path, bad: float
) -> None:
    async with Client(server) as client:
        session = await open_session(client, clip_file)
        async with connect_control(client, session) as socket, Puppeteer(client, session, "Ben") as ben:
            controller = RawPuppeteer(socket)
            epoch = await controller.claim_limb(0)
            good = controller.make_input(0, epoch, (0.3, 0.2, 0.4))
            await socket.send(good[:20] + struct.pack("<f", bad) + good[24:])
            problem = await controller.wait_for(Problem)
            assert isinstance(problem, Problem)
            assert "finite" in problem.detail
            with pytest.raises(ConnectionClosed) as closed:
                await controller.wait_for(Problem)
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1008
            await ben.claim("left_hand")


async def test_unreachable_target_and_unowned_limb_are_notified_once(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        session = await open_session(client, clip_file)
        async with connect_control(client, session) as socket, Puppeteer(client, session, "Ben") as ben:
            await ben.claim("right_hand")
            controller = RawPuppeteer(socket)
            epoch = await controller.claim_limb(0)
            for _ in range(20):
                await socket.send(controller.make_input(0, epoch, (1_000.0, 0.0, 0.0)))
            notice = await controller.wait_for(Notice)
            assert isinstance(notice, Notice)
            assert (notice.limb, notice.reason) == (0, "reach")
            for _ in range(20):
                await socket.send(controller.make_input(1, epoch, (0.3, 0.0, 0.0)))
            notice = await controller.wait_for(Notice)
            assert isinstance(notice, Notice)
            assert (notice.limb, notice.reason) == (1, "owner")
            await socket.send(Claim(1).pack())
            refusal = await controller.wait_for(Refusal)
            assert refusal == Refusal(1, "held", ben.id)


async def test_input_flood_is_rate_limited_without_effect_on_others(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        session = await open_session(client, clip_file)
        watched = client.socket_url(f"/v1/sessions/{session}/stream")
        async with (
            connect(watched, subprotocols=[SUBPROTOCOL], compression=None) as viewer,  # type: ignore[list-item]
            Puppeteer(client, session, "Ben") as ben,
            connect_control(client, session) as socket,
        ):
            controller = RawPuppeteer(socket)
            await ben.claim("right_hand")
            await ben.target("right_hand", -0.3, 0.2, 0.4)
            epoch = await controller.claim_limb(0)

            async def send_flood() -> None:
                for _ in range(FLOOD_INPUTS):
                    await socket.send(controller.make_input(0, epoch, (0.3, 0.2, 0.4)))

            async def wait_for_rate_notice() -> Notice:
                while True:
                    notice = await controller.wait_for(Notice)
                    assert isinstance(notice, Notice)
                    if notice.reason == "rate":
                        return notice

            flooding = asyncio.create_task(send_flood())
            overlays: list[Overlay] = []
            presences: list[Presence] = []
            async with asyncio.timeout(HANG_TIMEOUT_S):
                assert (await wait_for_rate_notice()).limb == 0
                while len(overlays) < 60:
                    data = await viewer.recv()
                    assert isinstance(data, bytes)
                    message = unpack(data)
                    if isinstance(message, Overlay):
                        overlays.append(message)
                    if isinstance(message, Presence):
                        presences.append(message)
            flooding.cancel()
            await asyncio.gather(flooding, return_exceptions=True)
            # Ben still controls his limb, and overlays are still sent
            assert all(1 in overlay.limbs for overlay in overlays[-30:])
            assert presences[-1].limbs[1] == ben.id
            assert all(b.due > a.due for a, b in pairwise(overlays))
            await ben.target("right_hand", -0.2, 0.3, 0.4)
