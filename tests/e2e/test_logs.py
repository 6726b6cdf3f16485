"""Request ids across several processes on a real nats-server: the same id in each log, and no secret."""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx2
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from bunraku.wire.messages import SUBPROTOCOL, Welcome, unpack
from tests.credentials import SECRET, bearer_headers, make_token
from tests.processes import ServerProcess, free_port, nats_url_of, run_jetstream
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S

SERVICES = ("ingest", "session 1", "session 2")


class Deployment:
    """Service processes that log JSON lines."""

    def __init__(self, folder: Path) -> None:
        self.processes: dict[str, ServerProcess] = {}
        for name in SERVICES:
            port, service = free_port(), name.partition(" ")[0]
            command = [sys.executable, "-m", "bunraku.cli", "up", "--port", str(port), "--data", str(folder / "data")]
            (folder / name).mkdir()
            self.processes[name] = ServerProcess([*command, "--service", service], port, folder / name)

    def url(self, name: str) -> str:
        return f"http://127.0.0.1:{self.processes[name].port}"

    def log_text(self, name: str) -> str:
        return (self.processes[name].folder / "log").read_text()

    def log_lines(self, name: str, request: str | None = None) -> list[dict[str, Any]]:
        """Return the parsed log lines of a process, of one request or all."""
        parsed = [json.loads(line) for line in self.log_text(name).splitlines() if line.startswith("{")]
        return [line for line in parsed if request in (None, line.get("request_id"))]

    async def wait_for_log(self, name: str, request: str, event: str, **more: Any) -> None:
        """Wait until a process has logged an event of a request."""
        expected = {"event": event, **more}
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while not any(expected.items() <= line.items() for line in self.log_lines(name, request)):  # noqa: ASYNC110
                await asyncio.sleep(0.05)


@pytest.fixture
def deployment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Deployment]:
    (tmp_path / "nats").mkdir()
    with ExitStack() as stack, run_jetstream(tmp_path / "nats") as nats:
        for name, value in {
            "NO_COLOR": "1", "BUNRAKU_BUS": nats_url_of(nats), "BUNRAKU_LOGS": "json", "BUNRAKU_LOG_LEVEL": "debug",
            "BUNRAKU_SECRET": SECRET,
        }.items():  # fmt: skip
            monkeypatch.setenv(name, value)
        deployed = Deployment(tmp_path)
        for process in deployed.processes.values():
            stack.callback(process.stop)
            process.start()
        yield deployed


async def test_request_id_is_the_same_in_every_process_and_no_secret_is_logged(deployment: Deployment) -> None:
    token = make_token()
    async with httpx2.AsyncClient(headers=bearer_headers(token), timeout=HANG_TIMEOUT_S) as http:

        async def call(method: str, name: str, path: str, request: str, **more: Any) -> Any:
            response = await http.request(
                method, deployment.url(name) + path, headers={"X-Request-Id": request}, **more
            )
            assert response.headers["x-request-id"] == request
            return response.json()

        motion = (
            await call("POST", "ingest", "/v1/motions?filename=a.bvh", "upload-01", content=make_bvh_clip(4.0, 1))
        )["id"]
        await deployment.wait_for_log(
            "ingest", "upload-01", "job", job="make", motion=motion, outcome="made", service="ingest"
        )
        await deployment.wait_for_log(
            "ingest", "upload-01", "request", route="/v1/motions", status=201, path="/v1/motions"
        )

        session = (await call("POST", "session 1", "/v1/sessions", "opening-01", json={"motion": motion}))["id"]
        await call("PATCH", "session 2", f"/v1/sessions/{session}", "editing-01", json={"loop": False})
        await deployment.wait_for_log(
            "session 1", "editing-01", f"session {session}: edit", level="info", service="session"
        )
        await deployment.wait_for_log(
            "session 2", "editing-01", "request", method="PATCH", route="/v1/sessions/{session}"
        )

        # through three processes: requested at one, logged by the owner, recorded by ingest
        await call("POST", "session 2", f"/v1/sessions/{session}/recordings", "keeping-01", json={"seconds": 0.5})
        await deployment.wait_for_log("session 1", "keeping-01", f"session {session}: log")
        await deployment.wait_for_log("ingest", "keeping-01", "job", job="keep", outcome="made")
        await deployment.wait_for_log("session 2", "keeping-01", "request", status=201)

        # a problem document contains the id, whichever service it comes from
        wrong = await call("PATCH", "session 2", f"/v1/sessions/{session}", "wrong-001", json={"motion": "none"})
        assert (wrong["title"], wrong["request_id"]) == ("No such motion", "wrong-001")

        ticket = (await call("POST", "session 1", "/v1/tickets", "ticketing"))["ticket"]
        address = deployment.url("session 2").replace("http", "ws") + f"/v1/sessions/{session}/control?ticket={ticket}"
        for request, accepted in (("pulling-01", True), ("pulling-02", False)):
            headers = {"X-Request-Id": request}
            async with connect(address, subprotocols=[Subprotocol(SUBPROTOCOL)], additional_headers=headers) as socket:
                first = await socket.recv()
                assert isinstance(first, bytes)
                assert isinstance(unpack(first), Welcome) == accepted
                if not accepted:
                    with pytest.raises(ConnectionClosed):
                        await socket.recv()
        await deployment.wait_for_log("session 1", "pulling-01", f"session {session}: join")
        await deployment.wait_for_log("session 2", "pulling-01", "request", method="WEBSOCKET", status=101)
        await deployment.wait_for_log(
            "session 2", "pulling-02", f"refused '/v1/sessions/{session}/control': Ticket not valid"
        )

        expired = make_token(lifetime_s=-5)
        rejected = await http.get(deployment.url("ingest") + "/v1/motions", headers=bearer_headers(expired))
        assert rejected.status_code == 401
        assert rejected.json()["request_id"] == rejected.headers["x-request-id"]
        await deployment.wait_for_log(
            "ingest", rejected.json()["request_id"], "refused '/v1/motions': Link expired", level="info"
        )

    for name in SERVICES:
        log = deployment.log_text(name)
        for secret in (SECRET, token, expired, ticket, "ticket="):
            assert secret not in log, name
        # background work has no request id, and work for a request has no id but its own
        requests = {line.get("request_id") for line in deployment.log_lines(name)}
        assert "pulling-02" not in requests or name == "session 2"
        assert {"time", "level", "logger", "event", "service"} <= set.intersection(
            *map(set, deployment.log_lines(name))
        )
