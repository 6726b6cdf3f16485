"""Metrics of a real server, compared with what its clients counted."""

from __future__ import annotations

import asyncio
import base64
import os
from pathlib import Path

import httpx2
import pytest

from bunraku.client import Client, Puppeteer
from bunraku.runtime.settings import Settings
from bunraku.websocket.frame import Opcode
from bunraku.wire.messages import SUBPROTOCOL, unpack
from bunraku.wire.overlay import Overlay
from tests.credentials import SECRET, bearer_headers, make_token
from tests.metrics import scrape_metrics, scrape_until
from tests.processes import free_port
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S


class CountingViewer:
    """Viewer that counts the bytes after the handshake and records the types of the messages."""

    def __init__(self) -> None:
        self.bytes = 0
        self.types: list[int] = []
        self.limbs: list[int] = []
        self._reading: asyncio.Task[None]
        self._writer: asyncio.StreamWriter
        self._changed = asyncio.Event()

    async def open(self, url: str, path: str) -> None:
        host, _, port = url.partition("//")[2].partition(":")
        reader, self._writer = await asyncio.open_connection(host, int(port))
        key = base64.b64encode(os.urandom(16)).decode()
        self._writer.write(
            f"GET {path} HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            f"Sec-WebSocket-Protocol: {SUBPROTOCOL}\r\n\r\n".encode()
        )
        head = await reader.readuntil(b"\r\n\r\n")
        assert b" 101 " in head.splitlines()[0]
        # every byte adds latency on a constrained link
        assert b"x-request-id" not in head.lower()
        self._reading = asyncio.create_task(self._read(reader))

    async def _read(self, reader: asyncio.StreamReader) -> None:
        while True:
            try:
                first, size = await reader.readexactly(2)
                extended = {126: 2, 127: 8}.get(size, 0)
                size = int.from_bytes(await reader.readexactly(extended)) if extended else size
                payload = await reader.readexactly(size)
            except (asyncio.IncompleteReadError, ConnectionError):
                return
            self.bytes += 2 + extended + size
            if first & 15 == Opcode.PING:
                self._send_frame(Opcode.PONG, payload)
            if first & 15 == Opcode.BINARY:
                self.types.append(payload[0])
                if payload[0] == Overlay.TYPE:
                    overlay = unpack(payload)
                    assert isinstance(overlay, Overlay)
                    self.limbs.append(len(overlay.limbs))
            self._changed.set()

    async def wait_for_messages(self, kind: int, number: int) -> None:
        """Wait until `number` messages of a type were received."""
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while self.types.count(kind) < number:
                self._changed.clear()
                await self._changed.wait()

    def _send_frame(self, opcode: Opcode, payload: bytes) -> None:
        # frames of clients are masked (RFC 6455, 5.3); the mask may be zero
        self._writer.write(bytes([0x80 | opcode, 0x80 | len(payload), 0, 0, 0, 0]) + payload)

    async def close(self) -> None:
        """Send a close frame and read until the server closes."""
        self._send_frame(Opcode.CLOSE, (1000).to_bytes(2))
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await self._reading
        self._writer.close()


async def test_metrics_equal_what_clients_counted(tmp_path: Path) -> None:
    port = free_port()
    source = tmp_path / "one.bvh"
    source.write_bytes(make_bvh_clip(4.0, 1))
    with run_server(tmp_path / "data", metrics=f"127.0.0.1:{port}") as url:

        async def wait_for_metrics(**expected: float) -> None:
            """Wait until metrics have these values; keywords are `name` or `name__label__value`."""

            def read_metrics() -> dict[str, float]:
                found = scrape_metrics(port)
                values = {}
                for key in expected:
                    name, *labels = key.split("__")
                    values[key] = found.sum(name, **dict(zip(labels[::2], labels[1::2], strict=True)))
                return values

            end = asyncio.get_running_loop().time() + HANG_TIMEOUT_S
            while (values := await asyncio.to_thread(read_metrics)) != expected:
                assert asyncio.get_running_loop().time() < end, f"metrics are {values}, expected {expected}"

        async with Client(url) as client:
            motion = (await client.upload(source))["id"]
            await wait_for_metrics(
                job_duration_seconds_count__kind__make__outcome__made=1, jobs_running=0, jobs_waiting=0
            )
            source.write_text("no motion at all")
            with pytest.raises(Exception, match="HIERARCHY"):
                await client.upload(source)
            await wait_for_metrics(job_duration_seconds_count__kind__make__outcome__refused=1, uploads_under_way=0)

            session = (await client.open_session(motion))["id"]
            await wait_for_metrics(sessions=1, sessions_moved_total__how__opened=1, puppeteers=0, bus_up=1)

            single, viewers = CountingViewer(), [CountingViewer() for _ in range(12)]
            await single.open(url, f"/v1/motions/{motion}/stream?rate=1")
            for viewer in viewers:
                await viewer.open(url, f"/v1/sessions/{session}/stream?rate=0")
            await wait_for_metrics(
                viewers__of__motion=1, viewers__of__session=12, viewers_joined_total__of__session=12,
                watched_sessions=1, viewer_rates__rate__0__reason__pinned=12, viewer_rates__rate__1__reason__pinned=1,
            )  # fmt: skip

            async with Puppeteer(client, session, "Aiko") as puppeteer:
                await wait_for_metrics(puppeteers=1, limbs_held=0)
                await puppeteer.claim("left_hand")
                await wait_for_metrics(limbs_held=1)
                for step in range(20):
                    await puppeteer.target("left_hand", 0.3 + 0.005 * step, 0.1, 0.4)
                await wait_for_metrics(inputs_total=20)
                await viewers[-1].wait_for_messages(Overlay.TYPE, 5)
            # the puppeteer left, and the limb returns to the motion
            await wait_for_metrics(puppeteers=0, limbs_held=0)
            async with asyncio.timeout(HANG_TIMEOUT_S):
                while viewers[0].limbs[-1]:  # noqa: ASYNC110
                    await asyncio.sleep(0.02)

            # nothing more is sent: the timeline is paused, and nobody joins or leaves
            await client.edit_session(session, playing=False)
            for viewer in viewers:
                await viewer.close()
            await single.close()
            all_viewers = [single, *viewers]
            await wait_for_metrics(viewers=0, viewers_joined_total=13, watched_sessions=0)
            found = scrape_metrics(port)
            assert found.sum("sent_bytes_total") == sum(viewer.bytes for viewer in all_viewers)
            assert found.sum("sent_blocks_total") == sum(viewer.types.count(3) for viewer in all_viewers)
            assert found.sum("sent_overlays_total") == sum(viewer.types.count(5) for viewer in all_viewers)
            assert found.sum("sent_overlays_total") >= 12 * 5
            assert found.sum("solve_duration_seconds_count") >= 5
            assert 0 < found.sum("solve_duration_seconds_sum") < HANG_TIMEOUT_S
            assert found.sum("slow_viewers") == found.sum("held_bytes") == found.sum("skipped_overlays_total") == 0

            # requests are labelled by route, not by path or id
            metric = "request_duration_seconds_count"
            assert found.sum(metric, route="/v1/motions", method="POST", status="201") == 1
            assert found.sum(metric, route="/v1/motions", method="POST", status="422") == 1
            assert found.sum(metric, route="/v1/sessions/{session}/stream", method="WEBSOCKET", status="101") == 12
            assert found.sum(metric, route="/v1/sessions/{session}/control", method="WEBSOCKET", status="101") == 1
            assert found.sum(metric, route="/v1/sessions/{session}", method="PATCH", status="200") == 1
            text = "".join(str(family.samples) for family in found.families.values())
            assert motion not in text
            assert session not in text

            # metrics are not served at the public address
            async with httpx2.AsyncClient(base_url=url) as http:
                assert "bunraku_" not in (await http.get("/metrics")).text


def test_rejected_requests_are_counted_by_reason(tmp_path: Path) -> None:
    port = free_port()
    with run_server(tmp_path, metrics=f"127.0.0.1:{port}", secret=SECRET) as url:
        with httpx2.Client(base_url=url) as http:
            assert http.get("/v1/motions").status_code == 401
            assert http.get("/v1/motions", headers=bearer_headers(make_token(lifetime_s=-5))).status_code == 401
            assert http.get("/v1/motions", headers=bearer_headers("nonsense")).status_code == 401
            assert http.get("/v1/nothing/here", headers=bearer_headers(make_token())).status_code == 404
            assert http.request("BREW", "/v1/nothing", headers=bearer_headers(make_token())).status_code == 404
            assert http.get("/v1/motions", headers=bearer_headers(make_token())).status_code == 200
        found = scrape_until(port, lambda found: found.sum("request_duration_seconds_count") == 6)
        assert found.sum("refusals_total") == 5
        assert found.sum("refusals_total", reason="A link is needed", status="401") == 1
        assert found.sum("refusals_total", reason="Link expired", status="401") == 1
        assert found.sum("refusals_total", reason="Link not valid", status="401") == 1
        assert found.sum("refusals_total", reason="Not Found", status="404") == 2
        assert found.sum("request_duration_seconds_count", route="elsewhere", method="OTHER", status="404") == 1
        assert found.sum("request_duration_seconds_count", route="/v1/motions", status="401") == 3


@pytest.mark.parametrize("address", ["9100", "localhost:http", "0.0.0.0:0"])
def test_invalid_metrics_address_is_rejected(address: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="expected host:port"):
        Settings(data=tmp_path, metrics=address)
