"""A session whose owner is unavailable: viewers are asked to retry, not told that the session ended."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlsplit

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from bunraku.messaging.bus_nats import NatsBus
from bunraku.messaging.key_value import SESSION_KEY_PREFIX
from bunraku.messaging.key_value_nats import NatsKeyValueStore
from bunraku.wire.messages import SUBPROTOCOL, Problem, unpack
from tests.processes import nats_url_of, run_jetstream
from tests.servers import run_server


@pytest.mark.parametrize(("session", "code", "title"), [("left", 1013, "not here yet"), ("never", 4404, "No such")])
async def test_viewer_retries_unless_the_session_does_not_exist(
    tmp_path: Path, session: str, code: int, title: str
) -> None:
    with run_jetstream(tmp_path) as nats:
        bus = NatsBus(nats_url_of(nats))
        await bus.open()
        try:
            await NatsKeyValueStore(bus).put(f"{SESSION_KEY_PREFIX}.left", b"its last timeline")
        finally:
            await bus.close()
        with run_server(tmp_path / "data", services=("stream",), bus=nats_url_of(nats)) as server:
            address = f"ws://{urlsplit(server).netloc}/v1/sessions/{session}/stream"
            async with connect(address, subprotocols=[SUBPROTOCOL]) as socket:  # type: ignore[list-item]
                problem = unpack(bytes(await socket.recv(decode=False)))
                assert isinstance(problem, Problem)
                assert title in problem.title
                with pytest.raises(ConnectionClosed):
                    await socket.recv()
                assert socket.close_code == code
