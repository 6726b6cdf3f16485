from __future__ import annotations

import asyncio
import json
import zlib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bunraku.cli import app
from bunraku.client import Client, Puppeteer
from tests.props.samples import box_glb
from tests.servers import make_bvh_clip

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


def run(server: str, *arguments: str) -> str:
    result = RUN.invoke(app, ["props", *arguments, "--server", server])
    assert result.exit_code == 0, result.output
    return result.stdout


def test_props_are_brought_listed_and_removed(server: str, session: str) -> None:
    async def take() -> None:
        async with Client(server) as client, Puppeteer(client, session) as puppeteer:
            await puppeteer.put(1, "right_hand")

    assert run(server, session) == "no props\n"
    assert run(server, f"{server}/?session={session}", "fan", "ball") == "0  fan on the floor\n1  ball on the floor\n"
    asyncio.run(take())
    assert run(server, session, "branch", "--remove", "0") == "0  branch on the floor\n1  ball in the right hand\n"
    described = json.loads(run(server, session, "--json"))
    assert [entry["kind"] for entry in described["props"]] == ["branch", "ball"]


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["{session}", "sword"], 1, "there is no kind 'sword': it is fan, umbrella, ball, branch, or the id"),
        (["{session}", "sword.glb"], 2, "there is no file sword.glb"),
        (["sword.glb"], 2, "give a session before it"),
        (["{session}", "a" * 20], 1, "there is no stored prop"),
        (["--delete", "a" * 20], 1, "No such prop"),
        (["{session}", *["fan"] * 9], 2, "at most 8 props"),
        (["{session}", "--remove", "8"], 1, "props"),
        (["{server}/v1/motions/m"], 2, "give a session"),
        (["none", "fan"], 1, "No such session"),
    ],
)
def test_refusal_is_printed(server: str, session: str, arguments: list[str], code: int, message: str) -> None:
    filled = [argument.format(server=server, session=session) for argument in arguments]
    result = RUN.invoke(app, ["props", *filled, "--server", server])
    assert result.exit_code == code
    assert message in " ".join(result.output.split())
    assert "Traceback" not in result.output


def test_props_from_files_are_stored_brought_and_deleted(server: str, session: str, tmp_path: Path) -> None:
    path = tmp_path / "staff.glb"
    path.write_bytes(box_glb(5.0, 60.0, 5.5, -10.0))
    brought = run(server, session, str(path), "fan", str(path))
    assert brought.splitlines() == [
        "staff: Its 60 units seem to be centimetres: it is 0.6 m long.",
        "0  staff on the floor",
        "1  fan on the floor",
        "2  staff on the floor",
    ]
    kind = json.loads(run(server, session, "--json"))["props"][0]["kind"]
    assert f"{kind}  staff, 0.05 x 0.60 x 0.06 m, 12 triangles" in run(server).splitlines()
    assert run(server, session, kind, "--remove", "2").splitlines()[2] == "2  staff on the floor"
    assert kind not in run(server, "--delete", kind)
    assert f"0  {kind} on the floor" in run(server, session).splitlines()
