from __future__ import annotations

from bunraku.stream.edit_queue import EDIT_INTERVAL_US, EditQueue
from bunraku.wire.messages import Edit


def test_first_edit_takes_effect_at_once() -> None:
    edits = EditQueue()
    assert edits.take(5) is None
    edits.add(Edit(playing=False))
    assert edits.due_at == 0
    assert edits.take(5) == Edit(playing=False)
    assert edits.take(5 + EDIT_INTERVAL_US) is None


def test_edits_in_quick_succession_are_combined() -> None:
    edits = EditQueue()
    edits.add(Edit(position=1))
    assert edits.take(5) == Edit(position=1)
    for edit in (Edit(position=2, loop=True), Edit(playing=False), Edit(position=0)):
        edits.add(edit)
        assert edits.take(4 + EDIT_INTERVAL_US) is None
    assert edits.due_at == 5 + EDIT_INTERVAL_US
    assert edits.take(5 + EDIT_INTERVAL_US) == Edit(playing=False, position=0, loop=True)
