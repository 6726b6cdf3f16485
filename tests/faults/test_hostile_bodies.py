"""Hostile bodies to a server process: its memory stays, nothing is logged as an error, and other requests go on."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import httpx2
import msgpack
import pytest

from bunraku.http.access_control import Role
from bunraku.runtime.settings import Settings
from tests.credentials import SECRET, bearer_headers, make_token
from tests.processes import free_port
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S

MAX_GROWTH_KB = 50_000
CLIENTS = 8
ARM = "396-352-252-560-320-120"


class ServedProcess:
    """Server in a separate process, with a log in JSON."""

    def __init__(self, url: str, pid: int, log: Path) -> None:
        self.url, self.pid, self._log = url, pid, log

    @property
    def resident_kb(self) -> int:
        """Resident memory in kB."""
        status = Path(f"/proc/{self.pid}/status").read_text()
        return int(status.partition("VmRSS:")[2].split()[0])

    @property
    def peak_kb(self) -> int:
        """Highest resident memory since `reset_peak`, in kB."""
        status = Path(f"/proc/{self.pid}/status").read_text()
        return int(status.partition("VmHWM:")[2].split()[0])

    def reset_peak(self) -> None:
        """Forget the peak of the resident memory."""
        Path(f"/proc/{self.pid}/clear_refs").write_text("5")

    def log_records(self) -> list[dict[str, object]]:
        """Return the records of the log so far."""
        return [json.loads(line) for line in self._log.read_text().splitlines() if line.startswith("{")]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedProcess]:
    folder, port = tmp_path_factory.mktemp("hostile"), free_port()
    log = folder / "log"
    command = [sys.executable, "-m", "bunraku.cli", "up", "--port", str(port), "--data", str(folder / "data")]
    names = {f"BUNRAKU_{name.upper()}" for name in Settings.model_fields}
    environment = {name: value for name, value in os.environ.items() if name not in names}
    environment |= {"BUNRAKU_SECRET": SECRET, "BUNRAKU_LOGS": "json", "BUNRAKU_CONNECTS": "0"}
    with log.open("wb") as output:
        process = subprocess.Popen(command, stdout=output, stderr=output, env=environment, cwd=folder)
    url = f"http://127.0.0.1:{port}"
    try:
        with httpx2.Client(base_url=url, timeout=HANG_TIMEOUT_S) as http:
            for _ in range(600):
                with contextlib.suppress(httpx2.TransportError):
                    if http.get("/readyz").status_code == 200:
                        break
                signal.sigtimedwait([], 0.1)
            # loads the catalogue, the codec and the process from which workers are forked
            http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(0.3), headers=admin())
            http.post("/v1/solve", content=solve_request(1_000), headers=admin() | MSGPACK)
        yield ServedProcess(url, process.pid, log)
    finally:
        process.terminate()
        try:
            process.wait(HANG_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def admin() -> dict[str, str]:
    return bearer_headers(make_token())


MSGPACK = {"Content-Type": "application/msgpack"}
JSON = {"Content-Type": "application/json"}


def solve_request(targets: int) -> bytes:
    packed: bytes = msgpack.packb(
        {"proportions": ARM, "targets": [[0.1, -0.5, 0.4]] * targets, "legs": [0.5] * targets}
    )
    return packed


HOSTILE_BODIES = {
    "largest batch": ("/v1/solve", solve_request(10_000), MSGPACK),
    "empty arrays": ("/v1/solve", b"\xdd\x00\x0f\xff\x00" + b"\x90" * 0xFFF00, MSGPACK),
    "nested arrays that announce many values": ("/v1/solve", b"\xdd\x00\x0f\xff\xff" * 200_000, MSGPACK),
    "many legs": ("/v1/solve", msgpack.packb({"proportions": ARM, "legs": [0] * 1_000_000}), MSGPACK),
    "empty objects to scene": ("/scene", b"[" + b"{}," * 2_700_000 + b"{}]", JSON),
    "invalid keyframes to scene": ("/scene", b'{"camera":[' + b"{}," * 300_000 + b"{}]}", JSON),
    "open brackets to scene": ("/scene", b"[" * (8 << 20), JSON),
    "keys to scene": ("/scene", b"{" + b'"a":0,' * 1_300_000 + b'"a":0}', JSON),
    "empty objects to recordings": ("/recordings", b'{"camera":[' + b"{}," * 2_700_000 + b"{}]}", JSON),
    "open brackets to recordings": ("/recordings", b"[" * (8 << 20), JSON),
    "string to recordings": ("/recordings", b'{"name":"' + b"a" * (8 << 20 >> 1) + b'"}', JSON),
}


@pytest.mark.parametrize(("path", "body", "headers"), HOSTILE_BODIES.values(), ids=HOSTILE_BODIES)
async def test_hostile_body_costs_the_server_no_memory(
    served: ServedProcess, path: str, body: bytes, headers: dict[str, str]
) -> None:
    async with httpx2.AsyncClient(base_url=served.url, timeout=HANG_TIMEOUT_S) as http:
        motion = (await http.get("/v1/motions", headers=admin())).json()["items"][0]["id"]
        session = (await http.post("/v1/sessions", json={"motion": motion}, headers=admin())).json()["id"]
        paths = {"/scene": f"/v1/motions/{motion}/scene", "/recordings": f"/v1/sessions/{session}/recordings"}
        tokens = [bearer_headers(make_token(Role.INGEST, f"mallory {number}")) for number in range(CLIENTS)]
        before = served.resident_kb
        served.reset_peak()
        posts = [http.post(paths.get(path, path), content=body, headers=headers | token) for token in tokens]
        responses = await asyncio.gather(*posts)
        await http.delete(f"/v1/sessions/{session}", headers=admin())
    assert {response.status_code for response in responses} <= {200, 400, 413, 422, 503}
    assert served.peak_kb - before < MAX_GROWTH_KB
    assert [record for record in served.log_records() if record["level"] in ("error", "critical")] == []


@pytest.mark.parametrize("path", ["/v1/solve", "/v1/motions?filename=a.bvh", "/v1/motions/none/scene", "/v1/sessions"])
async def test_client_that_leaves_within_its_body_is_logged_as_499(served: ServedProcess, path: str) -> None:
    request_id = f"left-{path.partition('?')[0].replace('/', '-')}"
    parts = urlsplit(served.url)
    head = [f"POST {path} HTTP/1.1", "Host: stage", "Content-Length: 4000", "Content-Type: application/json"]
    head += [f"{name}: {value}" for name, value in admin().items()] + [f"X-Request-Id: {request_id}"]
    with socket.create_connection((parts.hostname, parts.port)) as client:
        client.sendall("\r\n".join([*head, "", ""]).encode() + b"[")
        # reset instead of an orderly end
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while True:
            records = [record for record in served.log_records() if record.get("request_id") == request_id]
            if any(record["event"] == "request" for record in records):
                break
            await asyncio.sleep(0.05)
    assert [(record["level"], record["status"]) for record in records] == [("info", 499)]
