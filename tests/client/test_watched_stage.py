from __future__ import annotations

from bunraku.client import Viewer
from bunraku.client.watched_stage import WatchedStage
from bunraku.codec.extension.props import ShownState, encode_props
from bunraku.codec.motion_encoder import encode_motion
from bunraku.motion.placement import Placement
from bunraku.wire.messages import Data, Description, Presence, TimelineState
from bunraku.wire.prop import Prop, PropState
from tests.vectors.blocks import random_motion

FLOOR = PropState(None, Placement(0.5, -0.25, 1.5))


def test_stage_of_which_nothing_was_received_shows_nothing() -> None:
    stage = WatchedStage()
    assert (stage.track, stage.scenes, stage.performers, stage.audio) == (None, [], [], None)
    assert stage.pose_at(0) is None
    assert stage.extended_pose_at(0) is None
    assert stage.fingers_at(0) is None
    assert stage.expressions_at(0) == {}
    assert stage.contacts_at(0) is None
    assert stage.extension_of() is None
    assert stage.camera_at(0) is None
    assert (stage.props_at(0), stage.packets_from(0), stage.audio_buffered_us(0)) == ([], [], 0)


def test_props_are_those_of_the_session_and_then_those_of_the_motion() -> None:
    encoded = encode_motion(random_motion(1.0, 30.0, 5), error_bounds_mm=(30.0,), grade="live")
    passed: list[ShownState] = [*[FLOOR] * 15, *[PropState(1)] * 15]
    brought: list[ShownState] = [*[None] * 15, *[FLOOR] * 15]
    props = encode_props(["ball", "abcdefghij234567abcd"], [passed, brought], encoded.track)
    viewer = Viewer("ws://stage/stream")
    entry = {"prop": 2, "kind": "fan", "limb": 4, "place": [0.0, 0.0, 0.0]}
    fan = Prop("fan", PropState(4, Placement(0.0, 0.0, 0.0)))
    messages = [
        Description("m", [encoded.describe(), props.describe()]),
        TimelineState(1, "m", 0, 0, True, True, 1_000_000),
        Presence(1, [], [None] * 8, [], props=[entry]),
    ]
    for message in messages:
        viewer._on_message(message.pack())
    assert viewer.props_at(0) == [fan]
    for index, block in enumerate(props.ladder[0].blocks):
        viewer._on_message(Data(1, 0, index, block).pack())
    early, late = viewer.props_at(200_000), viewer.props_at(800_000)
    assert [prop.kind for prop in early] == ["fan", "ball"]
    assert [(prop.kind, prop.state.limb) for prop in late] == [("fan", 4), ("ball", 1), ("abcdefghij234567abcd", None)]


def test_motion_that_the_timeline_does_not_play_is_not_shown() -> None:
    encoded = encode_motion(random_motion(1.0, 30.0, 5), error_bounds_mm=(30.0,), grade="live")
    viewer = Viewer("ws://stage/stream")
    viewer._on_message(Description("m", [encoded.describe()]).pack())
    viewer._on_message(Data(0, 0, 0, encoded.ladder[0].blocks[0]).pack())
    viewer._on_message(TimelineState(1, "other", 0, 0, False, True, 1_000_000).pack())
    assert viewer.track is not None
    assert viewer.pose_at(0) is None
    viewer._on_message(TimelineState(2, "m", 0, 0, False, True, 1_000_000).pack())
    assert viewer.pose_at(0) is not None
