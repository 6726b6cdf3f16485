"""Tickets and share links across two replicas that share a secret, a catalogue and a real nats-server."""

from __future__ import annotations

import asyncio
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx2
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from bunraku.client import Client
from bunraku.http.access_control import Role
from bunraku.wire.messages import SUBPROTOCOL, ChannelHeader, Problem, unpack
from tests.credentials import SECRET, bearer_headers, make_token
from tests.processes import nats_url_of, run_jetstream
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S


async def first_message(url: str) -> object:
    """Return the first message of a connection."""
    async with connect(url, subprotocols=[SUBPROTOCOL]) as socket:  # type: ignore[list-item]
        data = await socket.recv()
        assert isinstance(data, bytes)
        return unpack(data)


async def test_ticket_and_share_link_are_valid_at_every_replica(tmp_path: Path) -> None:
    (tmp_path / "nats").mkdir()
    source = tmp_path / "a.bvh"
    source.write_bytes(make_bvh_clip(2.0, 5))
    with ExitStack() as stack:
        nats = stack.enter_context(run_jetstream(tmp_path / "nats"))
        options: dict[str, Any] = {"bus": nats_url_of(nats), "secret": SECRET}
        one, two = [stack.enter_context(run_server(tmp_path / "data", **options)) for _ in range(2)]
        async with Client(one, make_token(Role.ADMIN)) as host, httpx2.AsyncClient(base_url=two) as other:
            motion = (await host.upload(source))["id"]
            session = (await host.open_session(motion))["id"]
            share = await host.share(session=session)
            stream = f"/v1/sessions/{session}/stream"
            for issuer, redeemer in ((one, two), (two, one)):
                async with httpx2.AsyncClient(base_url=issuer, headers=bearer_headers(share["token"])) as viewer:
                    ticket = (await viewer.post("/v1/tickets")).json()["ticket"]
                address = redeemer.replace("http", "ws") + f"{stream}?ticket={ticket}"
                assert isinstance(await first_message(address), ChannelHeader)
                for again in (address, address.replace(redeemer.replace("http", "ws"), issuer.replace("http", "ws"))):
                    problem = await first_message(again)
                    assert isinstance(problem, Problem)
                    assert problem.title == "Ticket not valid"
            # a link that is revoked at one replica is invalid at the other, whose connections close
            stream_url = two.replace("http", "ws") + stream
            async with connect(
                stream_url,
                subprotocols=[SUBPROTOCOL],  # type: ignore[list-item]
                additional_headers=bearer_headers(share["token"]),
            ) as socket:
                await socket.recv()
                await host.revoke_share(share["id"])

                async def read_until_closed() -> None:
                    async with asyncio.timeout(HANG_TIMEOUT_S):
                        while True:
                            await socket.recv()

                with pytest.raises(ConnectionClosed) as closed:
                    await read_until_closed()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 4401
            response = await other.get(f"/v1/sessions/{session}", headers=bearer_headers(share["token"]))
            assert response.json()["title"] == "Link revoked"
