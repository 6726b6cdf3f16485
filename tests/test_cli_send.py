from __future__ import annotations

import json
import re
import socket
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bunraku.cli import app
from bunraku.output import vmc
from tests.output.vmc_receiver import parse_packet, receive_frame
from tests.time_limit import HANG_TIMEOUT_S

RUN = CliRunner()


def plain(text: str) -> str:
    """Return printed text without the frames and line breaks of rich."""
    return re.sub(r"[\s│]+", " ", text)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["vmc", "s"], "Missing option '--to'"),
        (["vmc", "s", "--to", "host:port"], "'host:port' is not HOST:PORT with a port of 1..65535"),
        (["vmc", "s", "--to", "host:0"], "'host:0' has no port of 1..65535: write HOST:PORT"),
        (["osc", "s", "--to", "host"], "'host' has no port of 1..65535: write HOST:PORT"),
        (["vmc", "s", "--to", "host", "--fps", "0.5"], "greater than or equal to 1"),
        (["vmc", "s", "--to", "host", "--fps", "241"], "less than or equal to 240"),
        (["osc", "s", "--to", "host:1", "--fps", "nan"], "Invalid value for '--fps'"),
        (["vmc", "s", "--to", "host", "--scale", "0"], "Invalid value for '--scale'"),
        (["vmc", "s", "--to", "host", "--performer", "4"], "Invalid value for '--performer'"),
        (["vmc", "http://127.0.0.1:9/v1/motions/m", "--to", "host"], "address of a motion; give a session"),
        (["vmc", "http://127.0.0.1:9/v1/health", "--to", "host"], "is not the address of a motion or session"),
        (["dmx", "s", "--fps", "60"], "less than or equal to 44"),
        (["dmx", "s", "--universe", "0"], "a universe of sACN is 1..63999"),
        (["dmx", "s", "--protocol", "artnet", "--universe", "32768"], "a universe of Art-Net is 0..32767"),
        (["dmx", "s", "--protocol", "artnet"], "Art-Net needs the address of the node or of the broadcast"),
        (["dmx", "s", "--layout", "rgbw"], "a layout names the slots of a light"),
        (["dmx", "s", "--address", "513"], "Invalid value for '--address'"),
        (["dmx", "s", "--priority", "201"], "Invalid value for '--priority'"),
    ],
)
def test_wrong_usage_is_explained(arguments: list[str], message: str) -> None:
    result = RUN.invoke(app, ["send", *arguments], env={"COLUMNS": "200"})
    assert result.exit_code == 2
    assert message in plain(result.output)


def test_unreachable_server_and_unknown_session_are_explained(server: str) -> None:
    unknown = RUN.invoke(app, ["send", "vmc", "none", "--to", "127.0.0.1", "--server", server])
    assert unknown.exit_code == 1
    assert "No such session" in plain(unknown.output)
    away = RUN.invoke(app, ["send", "osc", "none", "--to", "127.0.0.1:9", "--server", "http://127.0.0.1:9"])
    assert away.exit_code == 1
    assert "Cannot reach Bunraku at http://127.0.0.1:9" in plain(away.output)


def open_session(server: str, clip_file: Path) -> str:
    """Upload a clip, open a session over it and return the session's address."""
    import httpx2

    motion = json.loads(RUN.invoke(app, ["upload", str(clip_file), "--server", server, "--json"]).stdout)["id"]
    opened = httpx2.post(f"{server}/v1/sessions", json={"motion": motion}, timeout=HANG_TIMEOUT_S)
    return f"{server}/v1/sessions/{opened.json()['id']}"


def test_session_is_sent_for_a_duration(server: str, clip_file: Path) -> None:
    session = open_session(server, clip_file)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.settimeout(HANG_TIMEOUT_S)
        receiver.bind(("127.0.0.1", 0))
        command = ["send", "vmc", session, "--to", f"127.0.0.1:{receiver.getsockname()[1]}", "--seconds", "0.6"]
        sent = RUN.invoke(app, [*command, "--fps", "30", "--json"])
        assert sent.exit_code == 0, sent.output
        statistics = json.loads(sent.stdout)
        assert statistics["frames"] == statistics["datagrams"] > 0
        frames = [receive_frame(parse_packet(receiver.recv(1 << 16))) for _ in range(statistics["frames"])]
    times = [frame.seconds for frame in frames]
    assert times[0] == 0.0
    assert times == sorted(times)
    # no bursts: a frame is never earlier than its place in a row without gaps, but for the slewing of the clock
    assert times[-1] > (len(times) - 1) / 30 * 0.9 - 1 / 30
    table = RUN.invoke(app, command)
    assert table.exit_code == 0
    assert "datagrams" in table.stdout


def test_missing_performer_and_unknown_host_are_explained(server: str, clip_file: Path) -> None:
    session = open_session(server, clip_file)
    absent = RUN.invoke(app, ["send", "vmc", session, "--to", "127.0.0.1:9", "--performer", "1"])
    assert absent.exit_code == 2
    assert "the stage has 1 performer, counted from 0" in plain(absent.output)
    unknown = RUN.invoke(app, ["send", "vmc", session, "--to", "nothing.invalid"])
    assert unknown.exit_code == 2
    assert "nothing.invalid" in plain(unknown.output)


def test_help_names_the_default_port() -> None:
    assert f"default port {vmc.DEFAULT_PORT}" in plain(RUN.invoke(app, ["send", "vmc", "--help"]).output)
