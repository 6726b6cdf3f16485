"""Props from the hands of a session to a recording, through a real server."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from bunraku.client import Client, Puppeteer, Viewer
from bunraku.motion.placement import Placement
from bunraku.wire.prop import Prop, PropState
from tests.patient_viewer import watch_until

FAN_IN_HAND = Prop("fan", PropState(1))
UMBRELLA_ON_FLOOR = Prop("umbrella", PropState(None, Placement(0.5, -1.25, 0.75)))


async def see_props(url: str, is_expected: Callable[[list[Prop]], bool]) -> None:
    """Watch a stream until its props are as expected."""
    viewer, seen = Viewer(url), [False]

    def look(time: int, _: object) -> None:
        # a prop in a hand has no place
        props = [
            prop if prop.state.limb is None else Prop(prop.kind, PropState(prop.state.limb))
            for prop in viewer.props_at(time)
        ]
        seen[0] = is_expected(props)

    await watch_until(viewer, lambda: seen[0], look)


async def test_prop_is_seen_by_everyone_and_stays_in_the_recording(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        session = (await client.open_session((await client.upload(clip_file))["id"]))["id"]
        url = client.socket_url(f"/v1/sessions/{session}/stream")
        await client.edit_session(session, props={"3": "fan", "5": "umbrella"})
        await see_props(url, lambda props: [prop.kind for prop in props] == ["fan", "umbrella"])
        async with Puppeteer(client, session, "Aiko") as aiko:
            await aiko.claim("right_hand")
            await aiko.put(3, "right_hand")
            await aiko.lay_down(5, *UMBRELLA_ON_FLOOR.state.place)
            await see_props(url, lambda props: props == [FAN_IN_HAND, UMBRELLA_ON_FLOOR])
        motion = (await client.record(session, name="with props", seconds=1.0))["id"]
        await see_props(
            client.socket_url(f"/v1/motions/{motion}/stream"), lambda props: props == [FAN_IN_HAND, UMBRELLA_ON_FLOOR]
        )
