from __future__ import annotations

import pytest
from pydantic import ValidationError

from bunraku.http.problem_details import validation_problem
from bunraku.marionette.crowd.policy import CrowdPolicy
from bunraku.session.schema import NewSession, SessionEdit
from bunraku.wire.limbs import LIMBS, MAX_LIMBS
from bunraku.wire.prop import MAX_PROPS


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


@pytest.mark.parametrize(
    ("values", "field", "detail"),
    [
        ({"props": {"99": "fan"}}, "props.99", "there is no prop '99': props are 0 to 7"),
        ({"props": {"\uff11": "fan"}}, "props.\uff11", "there is no prop"),
        ({"props": {"01": "fan"}}, "props.01", "there is no prop"),
        (
            {"props": {"0": "sword"}},
            "props.0",
            "there is no kind 'sword': it is fan, umbrella, ball, branch, or the id",
        ),
        ({"props": {"0": "A" * 20}}, "props.0", "there is no kind"),
        ({"crowd": {"77": "vote"}}, "crowd.77", "there is no limb '77': limbs are left_hand"),
        # a digit of another script
        ({"crowd": {"\uff10": "vote"}}, "crowd.\uff10", "there is no limb"),
        ({"crowd": {"left_hand": "vote", "0": "turns"}}, "crowd", "left_hand and 0 are the same limb"),
    ],
)
def test_wrong_key_of_an_edit_is_explained(values: dict[str, object], field: str, detail: str) -> None:
    with pytest.raises(ValidationError) as invalid:
        SessionEdit.model_validate(values)
    problem = validation_problem(invalid.value)
    assert problem.extra["field"] == field
    assert problem.detail is not None
    assert problem.detail.startswith(f"{field}: {detail}")


def test_all_limbs_and_props_have_a_key() -> None:
    crowd = {**dict.fromkeys(LIMBS, "vote"), **{str(number): "turns" for number in range(len(LIMBS), MAX_LIMBS)}}
    edit = SessionEdit.model_validate({"crowd": crowd, "props": {str(number): "fan" for number in range(MAX_PROPS)}})
    assert sorted(edit.open_limbs({})) == list(range(MAX_LIMBS))
    assert sorted(edit.prop_kinds({})) == list(range(MAX_PROPS))


def test_new_session_plays_and_loops_by_default() -> None:
    new = NewSession(motion="one")
    assert (new.playing, new.loop) == (True, True)
    with pytest.raises(ValidationError):
        NewSession.model_validate({"motion": "a" * 65})


def test_stored_props_are_told_from_built_in_kinds() -> None:
    edit = SessionEdit.model_validate({"props": {"0": "fan", "3": "abcdefghij234567abcd", "4": None}})
    assert edit.stored_props == {"3": "abcdefghij234567abcd"}
    assert edit.prop_kinds({4: "ball", 5: "branch"}) == {0: "fan", 3: "abcdefghij234567abcd", 5: "branch"}
