from __future__ import annotations

import msgpack
import pytest

from bunraku.messaging.bus import MemoryBus
from bunraku.messaging.key_value import MemoryKeyValueStore
from bunraku.runtime.problem import ProblemError
from bunraku.session.puppeteer_connection import PuppeteerConnection
from bunraku.session.schema import SessionEdit
from bunraku.session.stage_proxy import StageProxy


@pytest.mark.parametrize("session", ["", "*", ">", "a.b", "a b", "../x", "é", "a" * 65, "a\n"])
async def test_invalid_session_id_sends_no_request(monkeypatch: pytest.MonkeyPatch, session: str) -> None:
    bus, asked = MemoryBus(), []

    async def ask(subject: str, *_: object) -> bytes:
        asked.append(subject)
        return b""

    monkeypatch.setattr(bus, "request", ask)
    with pytest.raises(ProblemError) as refused:
        await StageProxy(session, bus, MemoryKeyValueStore()).end()
    assert refused.value.status == 404
    assert asked == []


async def test_no_response_gives_404_or_503_by_the_session_record() -> None:
    register = MemoryKeyValueStore()
    stage = StageProxy("s", MemoryBus(), register)
    with pytest.raises(ProblemError) as refused:
        await stage.describe()
    assert refused.value.status == 404
    await register.put("sessions.s", b"")
    with pytest.raises(ProblemError) as refused:
        await stage.describe()
    assert (refused.value.status, refused.value.extra) == (503, {"hint": "try again in a second"})


async def test_requests_and_responses_are_plain_values() -> None:
    bus, asked = MemoryBus(), []

    async def answer(question: bytes) -> bytes:
        asked.append(msgpack.unpackb(question))
        said = (
            {"answer": {"id": "s"}}
            if len(asked) == 1
            else {"problem": ProblemError(422, "No", "so", field="x").to_dict()}
        )
        packed: bytes = msgpack.packb(said)
        return packed

    bus.serve("session.s.edit", answer)
    stage = StageProxy("s", bus, MemoryKeyValueStore())
    assert await stage.edit(SessionEdit(position=5)) == {"id": "s"}
    with pytest.raises(ProblemError) as refused:
        await stage.edit(SessionEdit(playing=False))
    assert asked == [{"position": 5}, {"playing": False}]
    assert (refused.value.status, refused.value.title, refused.value.detail) == (422, "No", "so")
    assert refused.value.extra == {"field": "x"}


async def test_messages_of_a_puppeteer_are_published_in_order() -> None:
    bus, said = MemoryBus(), []
    bus.subscribe("session.s.said", lambda message: said.append(msgpack.unpackb(message)))
    stage, visitor = StageProxy("s", bus, MemoryKeyValueStore()), PuppeteerConnection()
    for message in (b"one", b"", None):
        stage.send(visitor, message)
    assert said == [[visitor.id, b"one"], [visitor.id, b""], [visitor.id, None]]
    assert stage.outgoing_subject(visitor) == f"session.s.told.{visitor.id}"
