"""A register whose server goes away and comes back: a real nats-server, killed, stopped and started again."""

from __future__ import annotations

import asyncio
import signal
from pathlib import Path

import pytest

from bunraku.backing.register_nats import NatsRegister
from bunraku.backing.unavailable import Unavailable
from tests.processes import free_port, jetstream, url_of


async def test_what_was_put_is_there_when_the_server_is_back(tmp_path: Path) -> None:
    with jetstream(tmp_path) as server:
        register = NatsRegister(url_of(server))
        revision = await register.put("sessions.a", b"1", 0)
        server.kill()
        for failing in (register.get("sessions.a"), register.all("sessions"), register.put("sessions.a", b"2")):
            with pytest.raises(Unavailable, match="the register"):
                await failing
        await asyncio.to_thread(server.start)
        assert await register.put("sessions.a", b"2", revision) > revision
        await register.close()


async def test_a_server_that_stands_still_is_given_up(tmp_path: Path) -> None:
    with jetstream(tmp_path) as server:
        register = NatsRegister(url_of(server))
        await register.put("sessions.a", b"1")
        server.send(signal.SIGSTOP)
        try:
            async with asyncio.timeout(10):
                with pytest.raises(Unavailable):
                    await register.get("sessions.a")
        finally:
            server.send(signal.SIGCONT)
        found = await register.get("sessions.a")
        assert found is not None
        assert found.value == b"1"
        await register.close()


async def test_where_nobody_ever_was_it_is_said() -> None:
    register = NatsRegister(f"nats://127.0.0.1:{free_port()}")
    with pytest.raises(Unavailable):
        await register.get("a.b")
    await register.close()
