from __future__ import annotations

import json
import zlib
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from bunraku.cli import app
from tests.servers import make_bvh_clip

RUN = CliRunner()


def run_json(*arguments: str) -> Any:
    result = RUN.invoke(app, [*arguments, "--json"])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


@pytest.fixture
def motion(server: str, tmp_path: Path, request: pytest.FixtureRequest) -> str:
    """Upload a motion of the test's own."""
    path = tmp_path / "Heron.bvh"
    path.write_bytes(make_bvh_clip(1.0, zlib.crc32(request.node.name.encode()) % 10_000))
    motion_id: str = run_json("upload", str(path), "--server", server)["id"]
    return motion_id


def test_motion_is_renamed_tagged_and_found(server: str, motion: str) -> None:
    address = f"{server}/v1/motions/{motion}"
    assert run_json("rename", address, "Grauer REIHER")["name"] == "Grauer REIHER"
    assert run_json("tag", motion, "Vogel", "ganz langsam", "--server", server)["tags"] == ["Vogel", "ganz langsam"]
    for options in (["--search", "reiher"], ["--tag", "VOGEL"], ["--search", "grau", "--tag", "ganz langsam"]):
        assert [each["id"] for each in run_json("list", *options, "--server", server)] == [motion]
    assert run_json("list", "--search", "heron", "--server", server) == []
    shown = RUN.invoke(app, ["list", "--search", "reiher", "--server", server])
    assert "Vogel" in shown.stdout
    assert "tags" in shown.stdout
    assert RUN.invoke(app, ["rename", address, "Heron"]).stdout == f"{motion}: Heron\n"
    assert RUN.invoke(app, ["tag", address, "x"]).stdout == "Heron: x\n"
    assert RUN.invoke(app, ["tag", address]).stdout == "Heron: no tags\n"


def test_edit_creates_a_motion(server: str, motion: str) -> None:
    edited = run_json("edit", motion, "--start", "0.2", "--end", "0.6", "--mirror", "--loop", "--server", server)
    assert (edited["name"], edited["frames"], edited["made_from"]) == ("Heron, cut, mirrored, loop", 12, motion)
    shown = RUN.invoke(app, ["edit", f"{server}/v1/motions/{motion}", "--mirror", "--name", "Left"])
    assert shown.exit_code == 0, shown.output
    assert shown.stdout.startswith("1.00 s, Left: ")


def test_motions_are_encoded_again(server: str, motion: str) -> None:
    (result,) = run_json("reencode", f"{server}/v1/motions/{motion}")
    assert result["id"] == motion
    assert result["after"][-1] == result["before"][-1]
    shown = RUN.invoke(app, ["reencode", motion, "--server", server])
    assert shown.exit_code == 0, shown.output
    assert shown.stdout.startswith("1 of 1, Heron: ")
    assert "kbit/s" in shown.stdout
    missing = RUN.invoke(app, ["reencode", "ZZ", "--server", server])
    assert missing.exit_code == 1
    assert "No such motion" in missing.output


def test_reencode_needs_motions_of_one_server_or_all(server: str) -> None:
    for arguments in ([], ["ZZ", "--all"], [f"{server}/v1/motions/a", "http://other/v1/motions/b"]):
        assert RUN.invoke(app, ["reencode", *arguments]).exit_code == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["edit"], "Nothing to edit"),
        (["edit", "--start", "5"], "at least one frame"),
        (["edit", "--end", "5"], "the motion ends at"),
        (["rename", ""], "visible character"),
        (["tag", "a", "A"], "occurs twice"),
    ],
)
def test_refusal_is_printed(server: str, motion: str, arguments: list[str], message: str) -> None:
    command, *rest = arguments
    result = RUN.invoke(app, [command, motion, *rest, "--server", server])
    assert result.exit_code == 1
    assert message in " ".join(result.output.split())
    assert "Traceback" not in result.output


def test_address_of_a_session_is_refused(server: str) -> None:
    for command in (["rename", f"{server}/v1/sessions/s", "x"], ["tag", f"{server}/v1/sessions/s"]):
        result = RUN.invoke(app, command)
        assert result.exit_code == 2
        assert "give a motion" in result.output
