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
from tests.patient_viewer import use_patient_viewers
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S

RUN = CliRunner()
BUNRAKU = Path(sys.executable).parent / "bunraku"


@pytest.fixture(scope="module")
def protected(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, str]]:
    """Address of a server with a secret, and the id of a session."""
    with run_server(tmp_path_factory.mktemp("protected"), secret=SECRET) as url:
        with httpx2.Client(
            base_url=url, headers=bearer_headers(make_token(subject="host")), timeout=HANG_TIMEOUT_S
        ) as http:
            motion = http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(2.0, 5)).json()["id"]
            session = http.post("/v1/sessions", json={"motion": motion}).json()["id"]
        yield url, session


def test_token_uses_the_secret_of_environment_or_data_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BUNRAKU_SECRET", SECRET)
    created = RUN.invoke(app, ["token", "--role", "control", "--hours", "2", "--name", "aiko", "--session", "s1"])
    access = TokenSigner(SECRET).verify(created.stdout.strip(), time.time())
    assert (access.role, access.subject, access.session) == (Role.CONTROL, "aiko", "s1")
    assert access.expires == pytest.approx(time.time() + 7200, abs=60)
    result = json.loads(RUN.invoke(app, ["token", "--server", "https://stage.example/", "--json"]).stdout)
    assert result["link"] == f"https://stage.example/#token={result['token']}"
    assert result["role"] == "admin"
    link = RUN.invoke(app, ["token", "--server", "https://stage.example", "--session", "s1", "--role", "view"])
    assert link.stdout.startswith("https://stage.example/?session=s1#token=")
    monkeypatch.delenv("BUNRAKU_SECRET")
    own_secret = load_or_create_secret(tmp_path)
    created = RUN.invoke(app, ["token", "--data", str(tmp_path)])
    assert TokenSigner(own_secret).verify(created.stdout.strip(), time.time()).role is Role.ADMIN


def test_token_fails_without_valid_secret_and_never_prints_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for secret, options in (
        ("", []),
        ("short and secret", []),
        (SECRET, ["--role", "owner"]),
        (SECRET, ["--role", "admin", "--session", "s"]),
        (SECRET, ["--role", "view", "--session", "a b"]),
        (SECRET, ["--role", "view", "--motion", "m" * 65]),
    ):
        monkeypatch.setenv("BUNRAKU_SECRET", secret)
        rejected = RUN.invoke(app, ["token", "--data", str(tmp_path), *options])
        assert rejected.exit_code == 1, options
        assert "Traceback" not in rejected.output
        assert not secret or secret not in rejected.output
        assert rejected.output.strip()


def test_token_is_one_that_the_server_accepts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BUNRAKU_SECRET", SECRET)
    longest = RUN.invoke(app, ["token", "--hours", "168", "--name", "\x1b[31mai\u202eko"])
    access = TokenSigner(SECRET).verify(longest.stdout.strip(), time.time())
    assert access.subject == "aiko"
    assert RUN.invoke(app, ["token", "--hours", "168.1"]).exit_code == 2


def test_share_says_that_the_link_ends_with_the_token(
    protected: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    url, session = protected
    monkeypatch.setenv("BUNRAKU_TOKEN", make_token(Role.CONTROL, "host", lifetime_s=3_600))
    created = RUN.invoke(app, ["share", session, "--server", url])
    assert created.stdout.startswith(url)
    assert "ends with your token" in created.stderr
    monkeypatch.setenv("BUNRAKU_TOKEN", make_token(Role.ADMIN, "host", lifetime_s=3_600))
    assert "ends with" not in RUN.invoke(app, ["share", session, "--server", url]).stderr


def test_share_creates_lists_and_revokes_links(protected: tuple[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    use_patient_viewers(monkeypatch)
    url, session = protected
    monkeypatch.setenv("BUNRAKU_TOKEN", make_token(Role.CONTROL, "host"))
    created = json.loads(RUN.invoke(app, ["share", session, "--server", url, "--days", "1", "--json"]).stdout)
    assert created["link"] == f"{url}/?session={session}#share={created['token']}"
    shown = RUN.invoke(app, ["share", f"{url}/?session={session}"])
    assert shown.stdout.startswith(f"{url}/?session={session}#share=")
    listed = RUN.invoke(app, ["share", "--server", url])
    assert created["id"] in listed.stdout
    watched = ["watch", session, "--server", url, "--seconds", "0.4", "--json", "--token", created["token"]]
    assert json.loads(RUN.invoke(app, watched).stdout)["frames"] > 0
    assert RUN.invoke(app, ["share", "--revoke", created["id"], "--server", url]).stdout == f"Revoked {created['id']}\n"
    rejected = RUN.invoke(app, watched)
    assert rejected.exit_code == 1
    assert "Link revoked" in rejected.output


def test_commands_send_the_token_and_report_its_absence(
    protected: tuple[str, str], clip_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    url, _ = protected
    monkeypatch.delenv("BUNRAKU_TOKEN", raising=False)
    rejected = RUN.invoke(app, ["list", "--server", url])
    assert rejected.exit_code == 1
    assert "A link is needed" in rejected.output
    viewer, sender = make_token(Role.VIEW), make_token(Role.INGEST)
    assert (
        "needs the role ingest"
        in RUN.invoke(app, ["upload", str(clip_file), "--server", url, "--token", viewer]).output
    )
    uploaded = RUN.invoke(app, ["upload", str(clip_file), "--server", url, "--token", sender, "--json"])
    assert json.loads(uploaded.stdout)["id"]
    bench = ["bench", "viewers", "--n", "3", "--seconds", "0.3", "--server", url, "--token", viewer, "--json"]
    statistics = json.loads(RUN.invoke(app, bench).stdout)
    assert (statistics["joined"], statistics["dropped"]) == (3, 0)


def start_up_command(tmp_path: Path, *options: str, **environment: str) -> subprocess.Popen[str]:
    environ = {name: value for name, value in os.environ.items() if not name.startswith("BUNRAKU_")}
    return subprocess.Popen(
        [BUNRAKU, "up", "--port", "0", "--data", tmp_path / "data", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**environ, "NO_COLOR": "1", "COLUMNS": "80", **environment},
    )


def read_until(process: subprocess.Popen[str], pattern: str) -> str:
    assert process.stdout is not None
    for line in process.stdout:
        if match := re.search(pattern, line):
            return match[1]
    raise AssertionError(f"the command ended with {process.wait(HANG_TIMEOUT_S)}")


def test_public_server_creates_a_secret_and_prints_a_link(tmp_path: Path) -> None:
    process = start_up_command(tmp_path, "--host", "0.0.0.0")
    try:
        url = read_until(process, r"is at (http://\S+)/")
        token = read_until(process, r"^http://\S+#token=(\S+)$")
        assert (tmp_path / "data" / SECRET_FILE_NAME).stat().st_mode & 0o777 == 0o600
        with httpx2.Client(base_url=url) as http:
            assert http.get("/v1/motions").status_code == 401
            assert http.get("/v1/motions", headers=bearer_headers(token)).status_code == 200
        assert jwt.decode(token, options={"verify_signature": False})["sub"] == "operator"
    finally:
        process.terminate()
        process.wait(HANG_TIMEOUT_S)
        assert process.stdout is not None
        process.stdout.close()


def test_secret_in_environment_applies_on_loopback_too(tmp_path: Path) -> None:
    process = start_up_command(tmp_path, BUNRAKU_SECRET=SECRET)
    try:
        url = read_until(process, r"is at (http://\S+)/")
        assert "bunraku token --server" in read_until(process, r"(Clients need a link.*)")
        assert httpx2.get(f"{url}/v1/motions").status_code == 401
        assert not (tmp_path / "data" / SECRET_FILE_NAME).exists()
    finally:
        process.terminate()
        process.wait(HANG_TIMEOUT_S)
        assert process.stdout is not None
        process.stdout.close()


def test_public_processes_with_a_bus_need_a_shared_secret(tmp_path: Path) -> None:
    process = start_up_command(tmp_path, "--host", "0.0.0.0", BUNRAKU_BUS="nats://127.0.0.1:9")
    output, _ = process.communicate(timeout=HANG_TIMEOUT_S)
    assert process.returncode == 1
    assert "set BUNRAKU_SECRET" in output
    assert "Traceback" not in output


@pytest.mark.parametrize(("published", "needs_token"), [("127.0.0.1", False), ("0.0.0.0", True)])
def test_published_address_decides_whether_a_secret_is_needed(
    tmp_path: Path, published: str, needs_token: bool
) -> None:
    process = start_up_command(tmp_path, "--host", "0.0.0.0", BUNRAKU_PUBLISHED=published)
    try:
        url = read_until(process, r"is at (http://\S+)/")
        assert httpx2.get(f"{url}/v1/motions").status_code == (401 if needs_token else 200)
    finally:
        process.terminate()
        process.wait(HANG_TIMEOUT_S)
        assert process.stdout is not None
        process.stdout.close()


def test_short_secret_is_reported_without_its_value(tmp_path: Path) -> None:
    process = start_up_command(tmp_path, BUNRAKU_SECRET="tooshortasecret")
    output, _ = process.communicate(timeout=HANG_TIMEOUT_S)
    assert process.returncode != 0
    assert "32 bytes" in output
    assert "tooshortasecret" not in output
    assert "Traceback" not in output
