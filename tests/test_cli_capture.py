from __future__ import annotations

import re
import socket
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bunraku.cli import app

RUN = CliRunner()


def plain(text: str) -> str:
    """Return printed text without the frames and line breaks of rich."""
    return re.sub(r"[\s│]+", " ", text)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["vmc"], "give a new BVH file to record, --server to stream, or both"),
        (["vmc", "{folder}/take.bvh", "--name", "Aiko"], "give the server too, with --server"),
        (["vmc", "--server", "http://127.0.0.1:1", "--place", "1,2"], "1,2 is not X,Z,TURN"),
        (["vmc", "--server", "http://127.0.0.1:1", "--place", "1,nan,0"], "1,nan,0 is not X,Z,TURN"),
        (["vmc", "--session", "http://127.0.0.1:1/v1/motions/m"], "this is the address of a motion"),
        (["vmc", "{folder}/there.bvh", "--server", "http://127.0.0.1:1"], "exists already; give another name"),
        (["bvh", "{folder}/none.bvh"], "does not exist"),
        (["bvh", "{folder}/there.bvh"], "a brace or MOTION"),
        (["vmc", "{folder}/there.bvh"], "exists already; give another name"),
        (["vmc", "{folder}/no/take.bvh"], "there is no folder"),
        (["vmc", "{folder}/take.bvh", "--fps", "241"], "'--fps'"),
        (["vmc", "{folder}/take.bvh", "--port", "0"], "'--port'"),
        (["xsens", "{folder}/take.bvh", "--character", "-1"], "'--character'"),
        (["osc", "{folder}/take.bvh", "--port", "9000"], "Missing option '--mapping'"),
        (["osc", "{folder}/take.bvh", "--port", "9000", "--mapping", "{folder}/none.toml"], "does not exist"),
        (["osc", "{folder}/take.bvh", "--port", "9000", "--mapping", "{folder}/there.bvh"], "Invalid TOML"),
    ],
)
def test_invalid_argument_is_rejected_with_the_reason(tmp_path: Path, arguments: list[str], message: str) -> None:
    (tmp_path / "there.bvh").write_text("HIERARCHY [")
    result = RUN.invoke(app, ["capture", *(part.replace("{folder}", str(tmp_path)) for part in arguments)])
    assert result.exit_code == 2
    assert message.replace("{folder}", "") in plain(result.output).replace(str(tmp_path), "")
    assert [path.name for path in tmp_path.iterdir()] == ["there.bvh"]


def test_port_in_use_is_reported(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        result = RUN.invoke(app, ["capture", "rokoko", str(tmp_path / "take.bvh"), "--port", str(port)])
    assert result.exit_code == 2
    assert f"cannot listen at 127.0.0.1, port {port}" in plain(result.output)
