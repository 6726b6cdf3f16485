from __future__ import annotations

import pytest
from pydantic import ValidationError

from bunraku.session.schema import NewSession, SessionEdit


def test_what_is_left_out_of_an_edit_stays() -> None:
    assert SessionEdit().model_dump(exclude_none=True) == {}
    assert SessionEdit(position=0).model_dump(exclude_none=True) == {"position": 0}


@pytest.mark.parametrize("values", [{"position": -1}, {"position": 1 << 53}, {"position": 1.5}, {"speed": 2}])
def test_an_edit_has_whole_microseconds_and_nothing_unknown(values: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        SessionEdit.model_validate(values)


def test_a_session_plays_and_loops_unless_it_is_said_otherwise() -> None:
    new = NewSession(motion="one")
    assert (new.playing, new.loop) == (True, True)
    with pytest.raises(ValidationError):
        NewSession.model_validate({"motion": "a" * 65})
