"""Scenario of the fault tests: two viewers at different replicas, a puppeteer connected through a session replica that
does not own the session, and the motions that the stack has acknowledged so far."""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
import secrets
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import httpx2

from bunraku.client.api import Client
from bunraku.client.server_problem import ServerProblem
from tests.servers import make_bvh_clip
from tests.verify.participant import MonitoredPuppeteer, MonitoredViewer
from tests.verify.stack import Stack

PROBE_SOURCE = (Path(__file__).parent / "container_probe.py").read_bytes()
MAX_SILENCE_S = 5.0
"""Maximum time without a message at a viewer, seconds."""
MAX_CLOCK_ERROR_S = 0.1
"""Maximum error of a viewer's motion time, seconds."""
_OPEN_SESSION_SCRIPT = """
import json, sys, urllib.request
kind = {"Content-Type": "application/json"}
request = urllib.request.Request("http://127.0.0.1:8000/v1/sessions", sys.argv[1].encode(), kind)
print(urllib.request.urlopen(request, timeout=20).read().decode())
"""

_METRICS_SCRIPT = """
import urllib.request
print(urllib.request.urlopen("http://127.0.0.1:9100/metrics", timeout=20).read().decode())
"""
_APPLIED_INPUTS = re.compile(r'^bunraku_inputs_total\{outcome="(?:taken|reach)"\} (\S+)$', re.MULTILINE)


class Scenario:
    """One session, its participants, and the motions that must not be lost."""

    def __init__(self, stack: Stack, client: Client, motion: str, session: str) -> None:
        self.stack, self.client, self.motion, self.session = stack, client, motion, session
        self.acknowledged: list[str] = [motion]
        self.viewers: list[MonitoredViewer] = []
        self.puppeteer: MonitoredPuppeteer

    async def upload_motion(self, folder: Path, seconds: float = 1.0) -> str:
        """Upload a generated motion and return its id."""
        source = folder / f"{secrets.token_hex(4)}.bvh"
        source.write_bytes(make_bvh_clip(seconds, secrets.randbelow(1 << 30)))
        uploaded = (await self.client.upload(source))["id"]
        self.acknowledged.append(uploaded)
        return str(uploaded)

    async def record_motion(self) -> None:
        """Record the last second of the session as a motion."""
        self.acknowledged.append((await self.client.record(self.session, "kept", 1.0))["id"])

    async def find_lost_motions(self) -> list[str]:
        """Return the acknowledged motions that are missing or incomplete."""
        missing = []
        async with httpx2.AsyncClient(base_url=self.stack.url, timeout=10.0) as http:
            for motion in self.acknowledged:
                described = await http.get(f"/v1/motions/{motion}")
                blocks = described.json().get("blocks", 1) if described.status_code == 200 else 1
                requests = [http.get(f"/v1/motions/{motion}/blocks/0/{index}") for index in (0, blocks - 1)]
                responses = [described, *await asyncio.gather(*requests)]
                if any(response.status_code != 200 for response in responses):
                    missing.append(f"{motion} {[response.status_code for response in responses]}")
        return missing

    async def find_owner_replica(self) -> int:
        """Return the number of the session replica that owns the session: the first until another took over."""
        takeover = f"session {self.session} taken over"
        times = [await self.stack.last_logged("session", number, takeover) for number in (1, 2)]
        return times.index(max(times)) + 1

    async def count_applied_inputs(self) -> int:
        """Count the inputs that the present session replicas applied, by their metrics."""
        texts = [await self.stack.exec_in_replica("session", n, "python", "-c", _METRICS_SCRIPT) for n in (1, 2)]
        counts = [float(number) for text in texts for number in _APPLIED_INPUTS.findall(text)]
        assert len(counts) == 4, f"the metrics have {len(counts)} counts of inputs, expected two of each replica"
        return int(sum(counts))

    async def wait_for_overlays(self, since: float, seconds: float = 30.0) -> bool:
        """Wait until both viewers receive overlays of a controlled limb after `since`; return whether they do."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            now = time.monotonic()
            if all(one.overlay_times and one.overlay_times[-1] > max(since, now - 0.4) for one in self.viewers):
                return True
            await asyncio.sleep(0.05)
        return False

    def evaluate(self, since: float) -> tuple[dict[str, float], list[str]]:
        """Return figures of the viewers since `since`, and the violated limits."""
        silence = max(one.longest_silence_s(since) for one in self.viewers)
        clock_error = max(one.clock_error_s() for one in self.viewers)
        figures = {
            "resume_s": silence,
            "pull_s": max(one.longest_overlay_gap_s(since) for one in self.viewers),
            "off_ms": clock_error * 1e3,
        }
        violations = [f"a viewer gave up: {one.failure}" for one in self.viewers if one.failure is not None]
        if silence > MAX_SILENCE_S:
            violations.append(f"viewers received nothing for {silence:.1f} s")
        if clock_error > MAX_CLOCK_ERROR_S:
            violations.append(f"playback was {clock_error:.3f} s off")
        return figures, violations


@asynccontextmanager
async def open_scenario(stack: Stack, motion: str) -> AsyncIterator[Scenario]:
    """Open a session at the first session replica, its puppeteer connected through the other."""
    body = json.dumps({"motion": motion, "loop": True})
    response = await stack.exec_in_replica("session", 1, "python", "-c", _OPEN_SESSION_SCRIPT, body)
    session = json.loads(response)["id"]
    async with Client(stack.url) as client:
        scenario = Scenario(stack, client, motion, session)
        try:
            address = client.socket_url(f"/v1/sessions/{session}/stream")
            await _spread_viewers(scenario, address)
            await connect_through_other_replica(scenario)
            assert await scenario.wait_for_overlays(time.monotonic()), (
                "viewers receive no overlays of the controlled limb"
            )
            yield scenario
        finally:
            if hasattr(scenario, "puppeteer"):
                await scenario.puppeteer.stop()
            await asyncio.gather(*(one.stop() for one in scenario.viewers))
            with contextlib.suppress(ServerProblem, httpx2.TransportError):
                await asyncio.wait_for(_delete_session(client, session), 10.0)


async def _delete_session(client: Client, session: str) -> None:
    response = await client._http.delete(f"/v1/sessions/{session}")
    response.raise_for_status()


async def _spread_viewers(scenario: Scenario, address: str) -> None:
    """Connect two viewers to different replicas of the stream service."""
    used: int | None = None
    for _ in range(20):
        before = await scenario.stack.count_connections("stream")
        viewer = MonitoredViewer(address)
        await viewer.start()
        after = await scenario.stack.count_connections("stream")
        grown = [number for number in range(2) if after[number] > before[number]]
        if len(grown) == 1 and grown[0] != used:
            used = grown[0]
            scenario.viewers.append(viewer)
            if len(scenario.viewers) == 2:
                return
        else:
            await viewer.stop()
    raise AssertionError("two viewers did not connect to different replicas")


async def connect_through_other_replica(scenario: Scenario) -> None:
    """Connect the puppeteer through a session replica that does not own the session."""
    owner = await scenario.find_owner_replica()
    sent_inputs = 0
    for _ in range(20):
        if hasattr(scenario, "puppeteer"):
            await scenario.puppeteer.stop()
            sent_inputs = scenario.puppeteer.sent_inputs
        before = await scenario.stack.count_connections("session")
        scenario.puppeteer = MonitoredPuppeteer(scenario.client, scenario.session, sent_inputs)
        async with asyncio.timeout(30):
            while not scenario.puppeteer.connections:  # noqa: ASYNC110
                await asyncio.sleep(0.05)
        after = await scenario.stack.count_connections("session")
        if after[2 - owner] > before[2 - owner] and after[owner - 1] <= before[owner - 1]:
            return
    raise AssertionError("the puppeteer did not connect through the other replica")
