from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import httpx2
import jwt
import pytest
from typer.testing import CliRunner

from bunraku.cli import app
from bunraku.http.access_control import Role
from bunraku.http.access_token import TokenSigner
from bunraku.http.secret import SECRET_FILE_NAME, load_or_create_secret
from tests.credentials import SECRET, bearer_headers, make_token
from tests.servers import make_bvh_clip, run_server

RUN = CliRunner()
BUNRAKU = Path(sys.executable).parent / "bunraku"


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, str]]:
    """A server with a secret, and a session at it."""
    with run_server(tmp_path_factory.mktemp("guarded"), secret=SECRET) as url:
        with httpx2.Client(base_url=url, headers=bearer_headers(make_token(subject="host")), timeout=60) as http:
            motion = http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(2.0, 5)).json()["id"]
            session = http.post("/v1/sessions", json={"motion": motion}).json()["id"]
        yield url, session


def test_a_token_is_made_with_the_secret_of_the_environment_or_the_server_s_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BUNRAKU_SECRET", SECRET)
    made = RUN.invoke(app, ["token", "--role", "control", "--hours", "2", "--name", "aiko", "--session", "s1"])
    access = TokenSigner(SECRET).verify(made.stdout.strip(), time.time())
    assert (access.role, access.subject, access.session) == (Role.CONTROL, "aiko", "s1")
    assert access.expires == pytest.approx(time.time() + 7200, abs=60)
    told = json.loads(RUN.invoke(app, ["token", "--server", "https://stage.example/", "--json"]).stdout)
    assert told["link"] == f"https://stage.example/#token={told['token']}"
    assert told["role"] == "admin"
    link = RUN.invoke(app, ["token", "--server", "https://stage.example", "--session", "s1", "--role", "view"])
    assert link.stdout.startswith("https://stage.example/?session=s1#token=")
    monkeypatch.delenv("BUNRAKU_SECRET")
    own = load_or_create_secret(tmp_path)
    made = RUN.invoke(app, ["token", "--data", str(tmp_path)])
    assert TokenSigner(own).verify(made.stdout.strip(), time.time()).role is Role.ADMIN


def test_without_a_secret_or_with_a_bad_one_there_is_none_and_no_secret_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for secret, options in (
        ("", []),
        ("short and secret", []),
        (SECRET, ["--role", "owner"]),
        (SECRET, ["--role", "admin", "--session", "s"]),
        (SECRET, ["--role", "view", "--session", "a b"]),
    ):
        monkeypatch.setenv("BUNRAKU_SECRET", secret)
        refused = RUN.invoke(app, ["token", "--data", str(tmp_path), *options])
        assert refused.exit_code == 1, options
        assert "Traceback" not in refused.output
        assert not secret or secret not in refused.output
        assert refused.output.strip()


def test_links_for_viewers_are_made_listed_and_revoked(
    guarded: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    url, session = guarded
    monkeypatch.setenv("BUNRAKU_TOKEN", make_token(Role.CONTROL, "host"))
    made = json.loads(RUN.invoke(app, ["share", session, "--server", url, "--days", "1", "--json"]).stdout)
    assert made["link"] == f"{url}/?session={session}#share={made['token']}"
    shown = RUN.invoke(app, ["share", f"{url}/?session={session}"])
    assert shown.stdout.startswith(f"{url}/?session={session}#share=")
    listed = RUN.invoke(app, ["share", "--server", url])
    assert made["id"] in listed.stdout
    watched = ["watch", session, "--server", url, "--seconds", "0.4", "--json", "--token", made["token"]]
    assert json.loads(RUN.invoke(app, watched).stdout)["frames"] > 0
    assert RUN.invoke(app, ["share", "--revoke", made["id"], "--server", url]).stdout == f"Revoked {made['id']}\n"
    refused = RUN.invoke(app, watched)
    assert refused.exit_code == 1
    assert "Link revoked" in refused.output


def test_commands_come_in_with_a_token_and_say_what_is_missing_without(
    guarded: tuple[str, str], clip_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    url, _ = guarded
    monkeypatch.delenv("BUNRAKU_TOKEN", raising=False)
    refused = RUN.invoke(app, ["list", "--server", url])
    assert refused.exit_code == 1
    assert "A link is needed" in refused.output
    viewer, sender = make_token(Role.VIEW), make_token(Role.INGEST)
    assert (
        "needs the role ingest"
        in RUN.invoke(app, ["upload", str(clip_file), "--server", url, "--token", viewer]).output
    )
    uploaded = RUN.invoke(app, ["upload", str(clip_file), "--server", url, "--token", sender, "--json"])
    assert json.loads(uploaded.stdout)["id"]
    crowd = ["bench", "viewers", "--n", "3", "--seconds", "0.3", "--server", url, "--token", viewer, "--json"]
    figures = json.loads(RUN.invoke(app, crowd).stdout)
    assert (figures["joined"], figures["dropped"]) == (3, 0)


def start_up_command(tmp_path: Path, *options: str, **environment: str) -> subprocess.Popen[str]:
    given = {name: value for name, value in os.environ.items() if not name.startswith("BUNRAKU_")}
    return subprocess.Popen(
        [BUNRAKU, "up", "--port", "0", "--data", tmp_path / "data", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**given, "NO_COLOR": "1", "COLUMNS": "80", **environment},
    )


def read_until(process: subprocess.Popen[str], pattern: str) -> str:
    assert process.stdout is not None
    for line in process.stdout:
        if found := re.search(pattern, line):
            return found[1]
    raise AssertionError(f"it ended with {process.wait(10)}")


def test_bound_where_others_come_it_makes_a_secret_and_prints_the_link_that_lets_in(tmp_path: Path) -> None:
    process = start_up_command(tmp_path, "--host", "0.0.0.0")
    try:
        url = read_until(process, r"is at (http://\S+)/")
        held = read_until(process, r"^http://\S+#token=(\S+)$")
        assert (tmp_path / "data" / SECRET_FILE_NAME).stat().st_mode & 0o777 == 0o600
        with httpx2.Client(base_url=url) as http:
            assert http.get("/v1/motions").status_code == 401
            assert http.get("/v1/motions", headers=bearer_headers(held)).status_code == 200
        assert jwt.decode(held, options={"verify_signature": False})["sub"] == "operator"
    finally:
        process.terminate()
        process.wait(20)
        assert process.stdout is not None
        process.stdout.close()


def test_with_a_secret_of_the_environment_it_asks_on_loopback_too_and_prints_no_token(tmp_path: Path) -> None:
    process = start_up_command(tmp_path, BUNRAKU_SECRET=SECRET)
    try:
        url = read_until(process, r"is at (http://\S+)/")
        assert "bunraku token --server" in read_until(process, r"(Who comes needs a link.*)")
        assert httpx2.get(f"{url}/v1/motions").status_code == 401
        assert not (tmp_path / "data" / SECRET_FILE_NAME).exists()
    finally:
        process.terminate()
        process.wait(20)
        assert process.stdout is not None
        process.stdout.close()


def test_several_processes_that_others_reach_need_a_secret_that_they_share(tmp_path: Path) -> None:
    process = start_up_command(tmp_path, "--host", "0.0.0.0", BUNRAKU_BUS="nats://127.0.0.1:9")
    said, _ = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "set BUNRAKU_SECRET" in said
    assert "Traceback" not in said


@pytest.mark.parametrize(("published", "asked"), [("127.0.0.1", False), ("0.0.0.0", True)])
def test_in_a_container_it_matters_where_its_port_is_published(tmp_path: Path, published: str, asked: bool) -> None:
    process = start_up_command(tmp_path, "--host", "0.0.0.0", BUNRAKU_PUBLISHED=published)
    try:
        url = read_until(process, r"is at (http://\S+)/")
        assert httpx2.get(f"{url}/v1/motions").status_code == (401 if asked else 200)
    finally:
        process.terminate()
        process.wait(20)
        assert process.stdout is not None
        process.stdout.close()


def test_a_secret_that_is_too_short_is_said_so_without_it(tmp_path: Path) -> None:
    process = start_up_command(tmp_path, BUNRAKU_SECRET="tooshortasecret")
    said, _ = process.communicate(timeout=60)
    assert process.returncode != 0
    assert "32 bytes" in said
    assert "tooshortasecret" not in said
    assert "Traceback" not in said
