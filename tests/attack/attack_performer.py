"""Live performers who send too much, wrong poses, or come and go: rows 2, 5 and 11."""

from __future__ import annotations

import asyncio
import json
import time

import numpy as np

from bunraku.wire.live import MAX_ROOT_M, Sample
from tests.attack.attack_socket import BINARY, CALM, CLOSED_1008, flood_and_read, repeat
from tests.attack.raw_socket import connect_websocket, fetch_json, frame
from tests.attack.registry import MAX_RSS_GROWTH_MB, Report, Target, attack

TEXT = 1
PERFORMERS = 8
"""Performers that an attacker brings: as many as one subject may have."""
_RANDOM = np.random.default_rng(20)


def _random_samples(count: int) -> list[Sample]:
    """Return samples of now with positions and rotations that have nothing to do with each other."""
    now = time.time_ns() // 1000
    return [
        Sample(
            number,
            now + number,
            tuple(_RANDOM.uniform(-MAX_ROOT_M, MAX_ROOT_M, 3).astype(np.float32).tolist()),
            tuple(_RANDOM.integers(-32_768, 32_767, 54).tolist()),
        )
        for number in range(count)
    ]


async def _create_performers(target: Target, report: Report, count: int) -> list[str]:
    """Create live performers; return the paths of their input sockets."""
    paths = []
    for number in range(count):
        body = {"name": f"attacker {number}", "fps": 240}
        response = await fetch_json(target, "POST", "/v1/performers", body, token=target.tokens["ingest"])
        report.count("no answer" if response is None else f"created {response.status}")
        if response is not None and response.status == 201:
            paths.append(response.json()["input"])
    return paths


async def _end_performers(target: Target, paths: list[str]) -> None:
    for path in paths:
        await fetch_json(target, "DELETE", path.removesuffix("/input"), None, token=target.tokens["ingest"])


@attack(2, CLOSED_1008)
async def samples_of_eight_performers(target: Target, report: Report) -> None:
    """Flood the sockets of eight live performers with samples."""
    paths = await _create_performers(target, report, PERFORMERS)
    data = repeat(*(frame(BINARY, sample.pack()) for sample in _random_samples(64)))
    token = target.tokens["ingest"]
    await asyncio.gather(*(flood_and_read(target, report, path, data, token=token, must_close=True) for path in paths))
    await _end_performers(target, paths)


@attack(2, CALM)
async def wild_poses_at_the_permitted_rate(target: Target, report: Report) -> None:
    """Send poses that jump through the whole stage, 240 in a second, for eight performers."""
    paths = await _create_performers(target, report, PERFORMERS)

    async def run(path: str) -> None:
        opened = await connect_websocket(target, path, target.tokens["ingest"])
        if opened is None:
            report.count("refused")
            return
        until = time.monotonic() + target.seconds
        while time.monotonic() < until and not opened.is_closed:
            await opened.send(b"".join(frame(BINARY, sample.pack()) for sample in _random_samples(24)))
            report.count("samples", 24)
            await asyncio.sleep(0.1)
        opened.close()

    await asyncio.gather(*map(run, paths))
    await _end_performers(target, paths)


@attack(5, f"{CALM}; RSS +{MAX_RSS_GROWTH_MB:g} MB at most")
async def hostile_json_samples(target: Target, report: Report) -> None:
    """Send JSON samples that are nested, long, not numbers, or no JSON, each on a new connection."""
    (path,) = await _create_performers(target, report, 1)
    texts = [b"[" * 4_000, b"{" * 4_000, b"1" * 4_000, b"\xff" * 4_000, b'{"root": [1e999, 0, 0]}', b"\x00"]
    texts += [json.dumps({"root": [0, 1, 0], "rotations": {"x" * 3_000: [1, 0, 0, 0]}}).encode(), b"{}" * 2_000]
    until = time.monotonic() + target.seconds
    while time.monotonic() < until:
        for text in texts:
            opened = await connect_websocket(target, path, target.tokens["ingest"])
            if opened is None:
                report.count("refused")
                continue
            await opened.send(frame(TEXT, text))
            code = await opened.read_close_code()
            report.count(f"closed {code}")
            report.require(code in (1007, 1008, 1009), f"a malformed sample is answered with {code}")
            opened.close()
    await _end_performers(target, [path])


@attack(11, CALM)
async def performers_that_come_and_go(target: Target, report: Report) -> None:
    """Create and end live performers as fast as possible, more than one subject may have."""
    until = time.monotonic() + target.seconds
    while time.monotonic() < until:
        await _end_performers(target, await _create_performers(target, report, PERFORMERS + 4))
