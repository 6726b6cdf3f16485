from __future__ import annotations

import msgpack
import pytest

from bunraku.messaging.bus import MemoryBus
from bunraku.messaging.key_value import MemoryKeyValueStore
from bunraku.runtime.problem import ProblemError
from bunraku.session.schema import SessionEdit
from bunraku.session.stage_proxy import StageProxy
from tests.session.recording_puppeteer import RecordingPuppeteer


@pytest.mark.parametrize("session", ["", "*", ">", "a.b", "a b", "../x", "é", "a" * 65, "a\n"])
async def test_invalid_session_id_sends_no_request(monkeypatch: pytest.MonkeyPatch, session: str) -> None:
    bus, requests = MemoryBus(), []

    async def record_request(subject: str, *_: object) -> bytes:
        requests.append(subject)
        return b""

    monkeypatch.setattr(bus, "request", record_request)
    with pytest.raises(ProblemError) as refused:
        await StageProxy(session, bus, MemoryKeyValueStore()).end()
    assert refused.value.status == 404
    assert requests == []


async def test_no_response_gives_404_or_503_by_the_session_record() -> None:
    key_values = MemoryKeyValueStore()
    stage = StageProxy("s", MemoryBus(), key_values)
    with pytest.raises(ProblemError) as refused:
        await stage.describe()
    assert refused.value.status == 404
    await key_values.put("sessions.s", b"")
    with pytest.raises(ProblemError) as refused:
        await stage.describe()
    assert (refused.value.status, refused.value.extra) == (503, {"hint": "try again in a second"})


async def test_requests_and_responses_are_plain_values() -> None:
    bus, requests = MemoryBus(), []

    async def answer(request: bytes) -> bytes:
        requests.append(msgpack.unpackb(request))
        response = (
            {"answer": {"id": "s"}}
            if len(requests) == 1
            else {"problem": ProblemError(422, "No", "so", field="x").to_dict()}
        )
        packed: bytes = msgpack.packb(response)
        return packed

    bus.serve("session.s.edit", answer)
    stage = StageProxy("s", bus, MemoryKeyValueStore())
    assert await stage.edit(SessionEdit(position=5)) == {"id": "s"}
    with pytest.raises(ProblemError) as refused:
        await stage.edit(SessionEdit(playing=False))
    assert requests == [{"position": 5}, {"playing": False}]
    assert (refused.value.status, refused.value.title, refused.value.detail) == (422, "No", "so")
    assert refused.value.extra == {"field": "x"}


async def test_messages_of_a_puppeteer_are_published_in_order() -> None:
    bus, published = MemoryBus(), []
    bus.subscribe("session.s.said", lambda message: published.append(msgpack.unpackb(message)))
    stage, connection = StageProxy("s", bus, MemoryKeyValueStore()), RecordingPuppeteer()
    for message in (b"one", b"", None):
        stage.send(connection, message)
    assert published == [[connection.id, b"one"], [connection.id, b""], [connection.id, None]]
    assert stage.outgoing_subject(connection) == f"session.s.told.{connection.id}"
