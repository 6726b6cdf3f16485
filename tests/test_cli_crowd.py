from __future__ import annotations

import asyncio
import json
import zlib
from pathlib import Path
from typing import get_args

import pytest
from typer.testing import CliRunner
from websockets import Subprotocol
from websockets.asyncio.client import connect

from bunraku.cli import app
from bunraku.cli_crowd import CrowdPolicyName
from bunraku.client import Client
from bunraku.marionette.crowd.policy import CrowdPolicy
from bunraku.wire.messages import SUBPROTOCOL, Presence, unpack
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S

RUN = CliRunner()


@pytest.fixture
def session(server: str, tmp_path: Path, request: pytest.FixtureRequest) -> str:
    """Open a session of the test's own."""

    async def open_session() -> str:
        async with Client(server) as client:
            path = tmp_path / "crane.bvh"
            path.write_bytes(make_bvh_clip(1.0, zlib.crc32(request.node.name.encode()) % 10_000))
            session: str = (await client.open_session((await client.upload(path))["id"]))["id"]
            return session

    return asyncio.run(open_session())


async def open_limbs(server: str, session: str, count: int) -> list[tuple[int, str]]:
    """Return the limbs that viewers see open, and their policies, once there are `count`."""
    address = server.replace("http", "ws") + f"/v1/sessions/{session}/stream"
    async with asyncio.timeout(HANG_TIMEOUT_S), connect(address, subprotocols=[Subprotocol(SUBPROTOCOL)]) as socket:
        async for data in socket:
            assert isinstance(data, bytes)
            message = unpack(data)
            if isinstance(message, Presence) and len(message.crowd or []) == count:
                return [(entry["limb"], entry["policy"]) for entry in message.crowd or []]
    raise AssertionError("the stream ended")


def test_policies_are_those_of_the_server() -> None:
    assert get_args(CrowdPolicyName) == tuple(policy.value for policy in CrowdPolicy)


def test_limbs_are_opened_and_closed(server: str, session: str) -> None:
    address = f"{server}/?session={session}"
    opened = RUN.invoke(app, ["crowd", address, "right_hand", "2", "--policy", "median"])
    assert opened.exit_code == 0, opened.output
    assert opened.stdout == "right_hand, 2: open to all viewers, median\n"
    assert asyncio.run(open_limbs(server, session, 2)) == [(1, "median"), (2, "median")]
    closed = RUN.invoke(app, ["crowd", session, "2", "--close", "--server", server, "--json"])
    assert json.loads(closed.stdout)["id"] == session
    assert asyncio.run(open_limbs(server, session, 1)) == [(1, "median")]


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["s", "right_hand", "--policy", "loudest"], 2, "'loudest' is not one of"),
        (["{server}/v1/motions/m", "right_hand"], 2, "give a session"),
        (["none", "right_hand"], 1, "No such session"),
        (["{session}", "tail"], 1, "crowd"),
    ],
)
def test_refusal_is_printed(server: str, session: str, arguments: list[str], code: int, message: str) -> None:
    filled = [argument.format(server=server, session=session) for argument in arguments]
    result = RUN.invoke(app, ["crowd", *filled, "--server", server])
    assert result.exit_code == code
    assert message in " ".join(result.output.split())
    assert "Traceback" not in result.output
