"""A session whose server is gone, or not back on the bus yet: it is not said to have ended."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlsplit

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from bunraku.backing.bus_nats import NatsBus
from bunraku.backing.register import SESSIONS
from bunraku.backing.register_nats import NatsRegister
from bunraku.wire.messages import SUBPROTOCOL, Problem, unpack
from tests.processes import jetstream, url_of
from tests.servers import running


@pytest.mark.parametrize(("session", "code", "title"), [("left", 1013, "not here yet"), ("never", 4404, "No such")])
async def test_who_watches_is_told_to_come_again_unless_there_is_none(
    tmp_path: Path, session: str, code: int, title: str
) -> None:
    with jetstream(tmp_path) as nats:
        bus = NatsBus(url_of(nats))
        await bus.open()
        try:
            await NatsRegister(bus).put(f"{SESSIONS}.left", b"its last timeline")
        finally:
            await bus.close()
        with running(tmp_path / "data", services=("stream",), bus=url_of(nats)) as server:
            address = f"ws://{urlsplit(server).netloc}/v1/sessions/{session}/stream"
            async with connect(address, subprotocols=[SUBPROTOCOL]) as socket:  # type: ignore[list-item]
                said = unpack(bytes(await socket.recv(decode=False)))
                assert isinstance(said, Problem)
                assert title in said.title
                with pytest.raises(ConnectionClosed):
                    await socket.recv()
                assert socket.close_code == code
