from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from bunraku import __version__
from bunraku.cli import app
from tests.audio import make_tone, write_audio
from tests.motion.readers.sources import write_zip
from tests.patient_viewer import use_patient_viewers
from tests.servers import make_bvh_clip

RUN = CliRunner()


def test_upload_list_watch_and_version_print_json(
    server: str, clip_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    use_patient_viewers(monkeypatch)
    uploaded = RUN.invoke(app, ["upload", str(clip_file), "--server", server, "--json"])
    assert uploaded.exit_code == 0, uploaded.output
    motion = json.loads(uploaded.stdout)["id"]
    listed = json.loads(RUN.invoke(app, ["list", "--server", server, "--json"]).stdout)
    assert motion in [m["id"] for m in listed]
    for address in (motion, f"{server}/v1/motions/{motion}", f"{server}/v1/motions/{motion}/stream"):
        watched = RUN.invoke(app, ["watch", address, "--server", server, "--seconds", "0.4", "--json"])
        assert watched.exit_code == 0, watched.output
        statistics = json.loads(watched.stdout)
        assert statistics["frames"] > 0
        assert statistics["first_pose_ms"] > 0
        assert (statistics["camera_blocks"], statistics["camera"]) == (0, None)
    assert json.loads(RUN.invoke(app, ["version", "--json"]).stdout) == {"version": __version__}


def test_audio_creates_a_motion_with_sound(
    server: str, clip_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    use_patient_viewers(monkeypatch)
    song = str(write_audio(tmp_path / "song.wav", make_tone(1.0, 48_000), 48_000))
    motion = json.loads(RUN.invoke(app, ["upload", str(clip_file), "--server", server, "--json"]).stdout)["id"]
    added = RUN.invoke(app, ["audio", f"{server}/v1/motions/{motion}", song, "--json"])
    assert added.exit_code == 0, added.output
    sung = json.loads(added.stdout)
    assert sung["tracks"] == ["motion", "audio"]
    shown = RUN.invoke(app, ["audio", motion, song, "--server", server])
    assert "1.0 s of sound at" in shown.stdout
    assert sung["id"] in shown.stdout
    watched = RUN.invoke(app, ["watch", sung["id"], "--server", server, "--seconds", "0.4", "--json"])
    assert json.loads(watched.stdout)["audio_blocks"] > 0


def test_scene_creates_a_motion_with_lights(server: str, clip_file: Path, tmp_path: Path) -> None:
    motion = json.loads(RUN.invoke(app, ["upload", str(clip_file), "--server", server, "--json"]).stdout)["id"]
    show = tmp_path / "show.json"
    light = {"time": 0, "position": [-2, 4, 4], "colour": [1, 0.8, 0.5], "intensity": 1}
    show.write_text(json.dumps({"lights": [[light]]}))
    added = RUN.invoke(app, ["scene", f"{server}/v1/motions/{motion}", str(show), "--json"])
    assert added.exit_code == 0, added.output
    lit = json.loads(added.stdout)
    assert lit["tracks"] == ["motion", "light"]
    shown = RUN.invoke(app, ["scene", motion, str(show), "--server", server])
    assert shown.stdout == f"motion, light of {lit['name']}: {lit['id']}\n"
    show.write_text("{lights:")
    rejected = RUN.invoke(app, ["scene", motion, str(show), "--server", server])
    assert rejected.exit_code != 0
    assert "show.json is not JSON" in rejected.output


def test_perform_creates_a_motion_with_several_performers(server: str, clip_file: Path) -> None:
    motion = json.loads(RUN.invoke(app, ["upload", str(clip_file), "--server", server, "--json"]).stdout)["id"]
    created = RUN.invoke(app, ["perform", f"{server}/v1/motions/{motion}", motion, motion, "--json"])
    assert created.exit_code == 0, created.output
    trio = json.loads(created.stdout)
    assert (trio["performers"], trio["tracks"]) == (3, ["motion"] * 3)
    shown = RUN.invoke(app, ["perform", motion, motion, motion, "--server", server])
    assert shown.stdout == f"3 performers, {trio['name']}: {trio['id']}\n"
    rejected = RUN.invoke(app, ["perform", trio["id"], motion, motion, "--server", server])
    assert rejected.exit_code != 0
    assert "at most 4 performers" in rejected.output


def test_tables_are_printed_without_json(server: str, clip_file: Path) -> None:
    shown = RUN.invoke(app, ["upload", str(clip_file), "--server", server])
    assert "18 of 18" in shown.stdout
    assert "kbit/s" in shown.stdout
    assert clip_file.stem in RUN.invoke(app, ["list", "--server", server]).stdout


def test_upload_stores_all_takes_unless_one_is_named(server: str, tmp_path: Path) -> None:
    path = tmp_path / "takes.zip"
    path.write_bytes(write_zip({"a.bvh": make_bvh_clip(0.5, 51), "b.bvh": make_bvh_clip(0.5, 52), "c.bvh": b"x"}))
    shown = RUN.invoke(app, ["upload", str(path), "--server", server])
    assert shown.exit_code == 0, shown.output
    assert "takes \N{EN DASH} a.bvh" in shown.stdout
    assert "takes \N{EN DASH} b.bvh" in shown.stdout
    assert "Left out: c.bvh: Not a BVH file" in shown.stderr
    stored = json.loads(RUN.invoke(app, ["upload", str(path), "--server", server, "--json"]).stdout)
    assert (len(stored["items"]), stored["skipped"][0]["take"], stored["pending"]) == (2, "c.bvh", [])
    one = RUN.invoke(app, ["upload", str(path), "--server", server, "--take", "b.bvh", "--json"])
    assert json.loads(one.stdout) == stored["items"][1]


def test_failures_print_an_error_without_traceback(server: str, tmp_path: Path) -> None:
    bad = tmp_path / "bad.bvh"
    bad.write_text("nothing")
    for arguments in (
        ["upload", str(bad), "--server", server],
        ["watch", "none", "--server", server],
        ["watch", f"{server}/v1/motions/none", "--seconds", "1"],
        ["watch", f"{server}/v1/health"],
        ["keep", "none", "--server", server],
        ["keep", f"{server}/v1/motions/none"],
        ["audio", "none", str(bad), "--server", server],
        ["audio", f"{server}/v1/sessions/none", str(bad)],
        ["scene", f"{server}/v1/sessions/none", str(bad)],
        ["perform", "none", "none", "--server", server],
        ["perform", f"{server}/v1/sessions/none", "none"],
        ["list", "--server", "http://127.0.0.1:9"],
        ["upload", str(tmp_path / "missing.bvh"), "--server", server],
    ):
        result = RUN.invoke(app, arguments)
        assert result.exit_code != 0
        assert "Traceback" not in result.output
        assert not isinstance(result.exception, Exception) or isinstance(result.exception, SystemExit)


def test_bench_viewers_prints_statistics(server: str, clip_file: Path) -> None:
    motion = json.loads(RUN.invoke(app, ["upload", str(clip_file), "--server", server, "--json"]).stdout)["id"]
    command = ["bench", "viewers", "--n", "5", "--seconds", "0.3", "--url", f"{server}/v1/motions/{motion}"]
    statistics = json.loads(RUN.invoke(app, [*command, "--json"]).stdout)
    assert (statistics["viewers"], statistics["joined"], statistics["dropped"], statistics["stalls"]) == (5, 5, 0, 0)
    table = RUN.invoke(app, command)
    assert table.exit_code == 0
    assert "block late ms p99" in table.stdout
    rejected = RUN.invoke(app, ["bench", "viewers", "--n", "2", "--url", "ws://127.0.0.1:9/v1/sessions/s/stream"])
    assert rejected.exit_code == 1
    assert "Traceback" not in rejected.output


@contextmanager
def run_hostile_server(status: int, body: dict[str, Any]) -> Iterator[str]:
    """Run a server that answers every request with a JSON body, and yield its address."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            data = json.dumps(body).encode()
            self.send_response(status)
            self.send_header("Content-Length", str(len(data)))
            self.end_headers()
            self.wfile.write(data)

        def log_message(self, *_: object) -> None:
            """Log nothing."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()


HOSTILE = "\x1b]0;owned\x07\x1b[2J\u202e\x9b\x00\n[/red][link=http://evil.example]"


@pytest.mark.parametrize("command", [["list"], ["share"], ["watch", "m1"]])
@pytest.mark.parametrize("status", [200, 403])
@pytest.mark.parametrize("as_json", [False, True])
def test_hostile_server_does_not_control_the_terminal(command: list[str], status: int, as_json: bool) -> None:
    motion = {"id": HOSTILE, "name": HOSTILE, "duration": 1.0, "fps": 60, "rates": [], "tracks": [HOSTILE]}
    share = {"session": HOSTILE, "motion": None, "expires": HOSTILE}
    body = {"items": [{**motion, **share}], "next": None, "title": HOSTILE, "detail": HOSTILE, "hint": HOSTILE}
    with run_hostile_server(status, body) as url:
        result = RUN.invoke(app, [*command, "--server", url, *(["--json"] if as_json else [])])
    assert result.exception is None or isinstance(result.exception, SystemExit)
    assert not set(result.output) & set(HOSTILE) & {"\x1b", "\x07", "\x9b", "\x00", "\u202e"}
    if status == 200 and command[0] != "watch":
        assert (r"\u001b]0;owned" in result.output) is True
        if as_json:
            shown = json.loads(result.stdout)
            assert (shown if command == ["list"] else shown["items"])[0]["id"] == HOSTILE
