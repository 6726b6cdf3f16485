"""One server, its calm viewers and its puppeteer, and the attacks that run against it one after the other."""

from __future__ import annotations

import asyncio
import json
import re
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx2

from bunraku.client import Client
from bunraku.http.access_control import Role
from bunraku.wire.prop import MAX_PROPS
from tests.attack.probe import run_probe
from tests.attack.registry import SOURCE_ADDRESSES, Attack, Target
from tests.attack.resources import ResourceMeter, find_service_processes
from tests.attack.result import MAX_DESCRIPTORS_LEFT, AttackResult
from tests.attack.server import ServerUnderAttack, run_attacked_server
from tests.bench.fanout_processes import LineProcess
from tests.credentials import OTHER_SECRET, make_token, sign_token
from tests.servers import make_bvh_clip

VIEWERS = 12
CALM_WINDOW_S = 1.5
"""Duration of the windows before and after an attack, seconds. The first one is four times as long."""
SETTLE_WINDOWS = 40
"""Windows that the next attack waits for the effects of the last one to be over."""
DESCRIPTOR_TIMEOUT_S = 15.0
"""Time within which the server closes the descriptors of an attacker that is gone."""


class Lab:
    """Target of all attacks. `server` is None for a server that this process has not started."""

    def __init__(
        self,
        url: str,
        server: ServerUnderAttack | None,
        motion: str,
        session: str,
        observer: LineProcess,
        window_s: float = CALM_WINDOW_S,
    ) -> None:
        self.url, self.server, self.motion, self.session = url, server, motion, session
        self._observer = observer
        self._meter = server.meter if server is not None else ResourceMeter(find_service_processes)
        self._window_s = window_s
        self._last_gaps: dict[str, Any] | None = None
        self.calm_ms = self._measure_gaps(4 * window_s)["p99"]

    def run(self, attack: Attack, seconds: float, max_gap_ratio: float, attempts: int = 1) -> AttackResult:
        """Run an attack; repeat it if the only violation is the overlay gap."""
        for attempt in range(attempts):
            result = self._run_once(attack, seconds, max_gap_ratio)
            result.attempts = attempt + 1
            if not result.is_only_slow:
                break
        return result

    def _run_once(self, attack: Attack, seconds: float, max_gap_ratio: float) -> AttackResult:
        result = AttackResult(attack.name, attack.row, attack.criterion)
        target = self.make_target(seconds)
        with LineProcess([sys.executable, "-m", "tests.attack.attacker", attack.name]) as attacker:
            attacker.write_line(json.dumps(target.__dict__))
            attacker.read_line()
            result.gap_ms.before = self._settle()["p99"]
            before = self._meter.measure()
            logged = self.server.logged_bytes() if self.server is not None else 0
            with self._meter.record_peak() as peak:
                began = time.monotonic()
                self._observer.request("mark")
                attacker.write_line("go")
                self._follow(attack, attacker, result)
                gaps = self._observer.request("gaps")
                result.set_processor_shares(before, self._meter.measure(), time.monotonic() - began)
        self._last_gaps = self._measure_gaps(self._window_s)
        result.gap_ms.after = self._last_gaps["p99"]
        # a calm window beside another program is not as calm as the first one
        calm = max(self.calm_ms, min(result.gap_ms.before, 2 * self.calm_ms))
        result.judge_gap(calm, gaps, max_gap_ratio)
        after = self._meter.wait_for_descriptors(before.descriptors + MAX_DESCRIPTORS_LEFT, DESCRIPTOR_TIMEOUT_S)
        result.set_resources(before, peak[0], after)
        result.judge_resources(attack.max_rss_growth_mb)
        if self.server is not None:
            self._judge_log(result, self.server, logged)
        return result

    def _follow(self, attack: Attack, attacker: LineProcess, result: AttackResult) -> None:
        """Answer the attacker's peaks with the probe, and take over its report."""
        while True:
            try:
                event: dict[str, Any] = json.loads(attacker.read_line())
            except RuntimeError:
                result.violations.append("the attacker ended without a report")
                return
            if event["event"] == "peak":
                if attack.probe and (failure := self._run_probe(attack.probe)) is not None:
                    result.violations.append(failure)
                attacker.write_line("continue")
            else:
                result.answers = event["answers"]
                result.violations += event["violations"]
                return

    def _run_probe(self, name: str) -> str | None:
        role = {"upload": Role.INGEST, "solve": Role.VIEW, "ticket": Role.VIEW}.get(name, Role.CONTROL)
        return run_probe(name, self.url, make_token(role, "bystander"), self.motion, self.session)

    def _judge_log(self, result: AttackResult, server: ServerUnderAttack, logged: int) -> None:
        tracebacks = server.tracebacks_since(logged)
        if tracebacks:
            kinds = "; ".join(sorted(set(tracebacks))[:3])
            result.violations.append(f"{len(tracebacks)} tracebacks in the log: {kinds}")
        if server.process.poll() is not None:
            result.violations.append("the server has ended")

    def _measure_gaps(self, seconds: float) -> dict[str, Any]:
        self._observer.request("mark")
        time.sleep(seconds)
        gaps: dict[str, Any] = self._observer.request("gaps")
        return gaps

    def _settle(self) -> dict[str, Any]:
        """Wait for a calm window, and return its gaps. The window after the last attack may be one."""
        until = time.monotonic() + SETTLE_WINDOWS * self._window_s
        gaps, self._last_gaps = self._last_gaps, None
        while True:
            gaps = gaps or self._measure_gaps(self._window_s)
            if gaps["p99"] <= 1.2 * self.calm_ms or time.monotonic() > until:
                return gaps
            gaps = None

    def make_target(self, seconds: float) -> Target:
        """Return the target with tokens of a new subject, so that quotas of earlier attacks do not count."""
        subject = f"attacker {time.monotonic_ns()}"
        now = int(time.time())
        tokens = {role.label: make_token(role, subject, 3_600) for role in (Role.VIEW, Role.CONTROL, Role.INGEST)}
        tokens["bound control"] = make_token(Role.CONTROL, subject, 3_600, session=self.session)
        tokens["other ingest"] = make_token(Role.INGEST, f"{subject} too", 3_600)
        claims: dict[str, dict[str, Any]] = {
            "not valid before next year": {"nbf": now + 31_536_000},
            "not valid before an hour": {"nbf": now + 3_600},
            "issued in an hour": {"iat": now + 3_600, "exp": now + 7_200},
            "expires in ten years": {"exp": now + 315_360_000},
            "expires in eight days": {"exp": now + 8 * 86_400},
            "boolean expiry": {"exp": True},
            "expiry beyond 64 bits": {"exp": 1 << 70},
            "expiry as text": {"exp": str(now + 600)},
            "negative issue": {"iat": -1},
            "bound admin": {"session": self.session},
            "role of a number": {"role": 4},
            "subject of a number": {"sub": 5},
            "share without a row": {"share": "f" * 18, "role": "view"},
        }
        tokens |= {f"bad {name}": sign_token(**one) for name, one in claims.items()}
        tokens["bad signature"] = sign_token(OTHER_SECRET)
        tokens["bad algorithm"] = sign_token(algorithm="HS512")
        parts = urlsplit(self.url)
        assert parts.hostname is not None
        source = SOURCE_ADDRESSES if self.server is not None else ""
        port = parts.port or 80
        return Target(parts.hostname, port, self.session, self.motion, tokens, seconds, source)


@contextmanager
def open_lab(compose_url: str | None = None, viewers: int = VIEWERS, window_s: float = CALM_WINDOW_S) -> Iterator[Lab]:
    """Start a server, or use the one at `compose_url`, with viewers and a puppeteer of a new session."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="bunraku-attack-")))
        server = None if compose_url else stack.enter_context(run_attacked_server(folder / "server"))
        url = compose_url or server.url if server is not None else str(compose_url)
        motion, session = asyncio.run(_prepare(url, folder))
        observer = stack.enter_context(LineProcess([sys.executable, "-m", "tests.attack.observer"]))
        tokens = {
            "view": make_token(Role.VIEW, "audience", 86_400),
            "control": make_token(Role.CONTROL, "puppeteer", 86_400),
        }
        observer.write_line(json.dumps({"url": url, "session": session, "viewers": viewers, "tokens": tokens}))
        assert observer.read_line() == "ready"
        yield Lab(url, server, motion, session, observer, window_s)


async def _prepare(url: str, folder: Path) -> tuple[str, str]:
    """Open a session over a new motion, and use every kind of request once, so that all code is loaded."""
    source = folder / "stage.bvh"
    source.write_bytes(make_bvh_clip(20.0, 18))
    async with Client(url, make_token(Role.ADMIN, "host")) as client:
        motion = (await client.upload(source))["id"]
        session = (await client.open_session(motion))["id"]
        light = {"time": 0, "position": [0, 1, 0], "colour": [1, 1, 1], "intensity": 1}
        await client.add_scene(motion, {"lights": [[light]]})
        arm = "393-351-256-560-320-120"
        page = (await client._http.get("/")).text
        scripts = re.findall(r'src="(/[^"]+\.js)"', page)
        paths = ["/v1/openapi.json", "/v1/docs", f"/v1/arms/{arm}/table", f"/v1/arms/{arm}/figures/circle", *scripts]
        solve = {"proportions": arm, "targets": [[0.4, 0.1, 0.4]] * 2_000, "legs": [0.1]}
        requests = [("POST", "/v1/solve", solve), *(("GET", path, None) for path in paths)]
        for method, path, content in requests:
            with suppress(httpx2.TransportError):
                await client._http.request(method, path, json=content)
        await asyncio.sleep(2.0)
        await client.record(session, "warm", 1.0)
        await client.edit_session(session, props={str(number): "fan" for number in range(0, MAX_PROPS, 2)})
    return motion, session
