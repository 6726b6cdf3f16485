from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from pathlib import Path

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from bunraku.client import Client, ControlRefused, Puppeteer
from bunraku.wire.messages import SUBPROTOCOL, Claim, Grant, Input, Ping, Pong, Problem, Refusal, Welcome, unpack
from tests.time_limit import HANG_TIMEOUT_S


@pytest.fixture
async def session(server: str, clip_file: Path) -> str:
    async with Client(server) as client:
        return str((await client.open_session((await client.upload(clip_file))["id"]))["id"])


async def test_limb_is_granted_to_the_first_claim_until_released(server: str, session: str) -> None:
    async with Client(server) as client, Puppeteer(client, session, "Aiko") as aiko:
        async with Puppeteer(client, session, "Yuki") as yuki:
            await aiko.claim("left_hand")
            with pytest.raises(ControlRefused, match="held"):
                await yuki.claim("left_hand")
            await yuki.claim("right_leg")
            state = await client.session(session)
            assert state["limbs"] == [aiko.id, None, None, yuki.id]
            assert [(p["name"], p["colour"]) for p in state["puppeteers"]] == [("Aiko", 0), ("Yuki", 1)]
            await aiko.release("left_hand")
            await yuki.claim("left_hand")
        # a disconnect releases the limbs
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while any((await client.session(session))["limbs"]):  # noqa: ASYNC110
                await asyncio.sleep(0.01)
        await aiko.claim("left_hand")


async def test_name_of_a_puppeteer_is_cleaned(server: str, session: str) -> None:
    names = ("\x1b]0;owned\x07愛子\u202e\u200b 👩🏽\u200d🚀", "\u2066\x00\u3164", "か\u3099" * 50)
    async with Client(server) as client, AsyncExitStack() as puppeteers:
        for name in names:
            await puppeteers.enter_async_context(Puppeteer(client, session, name))
        shown = [one["name"] for one in (await client.session(session))["puppeteers"]]
    assert shown == ["愛子 👩🏽\u200d🚀", "Someone", "が" * 40]


async def test_silent_holder_loses_the_limb(server: str, session: str) -> None:
    url = server.replace("http", "ws") + f"/v1/sessions/{session}/control"
    async with connect(url, subprotocols=[SUBPROTOCOL], compression=None) as silent:  # type: ignore[list-item]
        await silent.send(Claim(1).pack())
        kinds = []
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while not isinstance(message := unpack(await silent.recv(decode=False)), Refusal):
                kinds.append(type(message))
    assert kinds[0] is Welcome
    assert Grant in kinds
    assert (message.limb, message.reason) == (1, "lost")


async def test_input_without_the_limb_is_ignored_and_ping_is_answered(server: str, session: str) -> None:
    url = server.replace("http", "ws") + f"/v1/sessions/{session}/control?name=%00%20"
    async with connect(url, subprotocols=[SUBPROTOCOL], compression=None) as socket:  # type: ignore[list-item]
        await socket.send(Input(0, Input.TARGET, 99, 1, 0, (1, 1, 1)).pack())
        await socket.send(Ping(3, 4).pack())
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while not isinstance(message := unpack(await socket.recv(decode=False)), Pong):
                continue
    assert (message.sequence, message.sent) == (3, 4)
    async with Client(server) as client:
        assert (await client.session(session))["limbs"] == [None] * 4


@pytest.mark.parametrize("data", [bytes([67]), Input(0, 1, 1, 1, 1, (float("nan"), 0, 0)).pack(), bytes(2000)])
async def test_malformed_message_closes_only_its_connection(server: str, session: str, data: bytes) -> None:
    url = server.replace("http", "ws") + f"/v1/sessions/{session}/control"
    async with Client(server) as client, Puppeteer(client, session, "Aiko") as aiko:
        with pytest.raises(ConnectionClosed) as closed:  # noqa: PT012
            async with connect(url, subprotocols=[SUBPROTOCOL], compression=None) as socket:  # type: ignore[list-item]
                await socket.send(data)
                while True:
                    message = unpack(await socket.recv(decode=False))
                    assert not isinstance(message, Problem) or message.detail
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code in (1008, 1009)
        await aiko.claim("left_hand")


async def test_control_of_an_unknown_session_is_refused(server: str) -> None:
    async with Client(server) as client:
        with pytest.raises(ControlRefused, match="No such session"):
            async with Puppeteer(client, "nothing"):
                pass
