from __future__ import annotations

import msgpack
import pytest

from bunraku.backing.bus import MemoryBus
from bunraku.backing.problems import ProblemError
from bunraku.backing.register import MemoryRegister
from bunraku.session.distant import DistantStage
from bunraku.session.requests import SessionEdit
from bunraku.session.visitor import Visitor


@pytest.mark.parametrize("session", ["", "*", ">", "a.b", "a b", "../x", "é", "a" * 65, "a\n"])
async def test_what_cannot_be_a_session_is_not_even_asked_for(session: str) -> None:
    bus, asked = MemoryBus(), []

    async def answer(question: bytes) -> bytes:
        asked.append(question)
        return b"\xc0"

    bus.answer(f"session.{session}.end", answer)
    with pytest.raises(ProblemError) as refused:
        await DistantStage(session, bus, MemoryRegister()).end()
    assert refused.value.status == 404
    assert asked == []


async def test_where_nobody_answers_the_register_tells_whether_to_come_again() -> None:
    register = MemoryRegister()
    stage = DistantStage("s", MemoryBus(), register)
    with pytest.raises(ProblemError) as refused:
        await stage.describe()
    assert refused.value.status == 404
    await register.put("sessions.s", b"")
    with pytest.raises(ProblemError) as refused:
        await stage.describe()
    assert (refused.value.status, refused.value.extra) == (503, {"hint": "try again in a second"})


async def test_questions_and_answers_are_plain_values() -> None:
    bus, asked = MemoryBus(), []

    async def answer(question: bytes) -> bytes:
        asked.append(msgpack.unpackb(question))
        said = (
            {"answer": {"id": "s"}}
            if len(asked) == 1
            else {"problem": ProblemError(422, "No", "so", field="x").values()}
        )
        packed: bytes = msgpack.packb(said)
        return packed

    bus.answer("session.s.edit", answer)
    stage = DistantStage("s", bus, MemoryRegister())
    assert await stage.edit(SessionEdit(position=5)) == {"id": "s"}
    with pytest.raises(ProblemError) as refused:
        await stage.edit(SessionEdit(playing=False))
    assert asked == [{"position": 5}, {"playing": False}]
    assert (refused.value.status, refused.value.title, refused.value.detail) == (422, "No", "so")
    assert refused.value.extra == {"field": "x"}


async def test_what_a_puppeteer_says_goes_to_the_stage_in_order() -> None:
    bus, said = MemoryBus(), []
    bus.subscribe("session.s.said", lambda message: said.append(msgpack.unpackb(message)))
    stage, visitor = DistantStage("s", bus, MemoryRegister()), Visitor()
    for message in (b"one", b"", None):
        stage.say(visitor, message)
    assert said == [[visitor.id, b"one"], [visitor.id, b""], [visitor.id, None]]
    assert stage.told(visitor) == f"session.s.told.{visitor.id}"
