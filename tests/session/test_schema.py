from __future__ import annotations

import pytest
from pydantic import ValidationError

from bunraku.marionette.crowd.policy import CrowdPolicy
from bunraku.session.schema import NewSession, SessionEdit


def test_omitted_fields_of_an_edit_are_excluded() -> None:
    assert SessionEdit().model_dump(mode="json", exclude_unset=True) == {}
    assert SessionEdit(position=0).model_dump(mode="json", exclude_unset=True) == {"position": 0}
    closed = SessionEdit(crowd={"right_hand": None, "4": CrowdPolicy.VOTE})
    assert closed.model_dump(mode="json", exclude_unset=True) == {"crowd": {"right_hand": None, "4": "vote"}}


@pytest.mark.parametrize(
    "values",
    [
        {"position": -1},
        {"position": 1 << 53},
        {"position": 1.5},
        {"speed": 2},
        {"crowd": {"16": "vote"}},
        {"crowd": {"tail": "vote"}},
    ],
)
def test_edit_with_fraction_or_unknown_field_is_invalid(values: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        SessionEdit.model_validate(values)


def test_new_session_plays_and_loops_by_default() -> None:
    new = NewSession(motion="one")
    assert (new.playing, new.loop) == (True, True)
    with pytest.raises(ValidationError):
        NewSession.model_validate({"motion": "a" * 65})
