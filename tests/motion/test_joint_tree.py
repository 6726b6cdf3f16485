from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion.joint_tree import ancestor_chain, common_ancestor, is_descendant


def test_ancestor_chain_leads_to_the_root() -> None:
    assert ancestor_chain([-1, 0, 1, 0], 2) == [2, 1, 0]


@st.composite
def parent_arrays(draw: st.DrawFn) -> list[int]:
    return [-1, *(draw(st.integers(0, joint - 1)) for joint in range(1, draw(st.integers(2, 12))))]


@given(parents=parent_arrays(), data=st.data())
def test_common_ancestor_is_the_lowest_one(parents: list[int], data: st.DataObject) -> None:
    joints = data.draw(st.lists(st.integers(0, len(parents) - 1), min_size=1, max_size=4))

    def over(joint: int) -> bool:
        return all(below == joint or is_descendant(parents, below, joint) for below in joints)

    found = common_ancestor(parents, joints)
    assert over(found)
    assert not any(over(joint) and is_descendant(parents, joint, found) for joint in range(len(parents)))
