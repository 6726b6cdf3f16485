"""Commands that send a session to other tools: `bunraku send`."""

from __future__ import annotations

import uuid
from enum import Enum
from typing import TYPE_CHECKING, Annotated

import typer

from bunraku.output import artnet, dmx, sacn
from bunraku.session_sender import SendOptions, send_session
from bunraku.terminal import DEFAULT_SERVER, JsonOption, ServerOption, TokenOption

if TYPE_CHECKING:
    from bunraku.client.datagram import DatagramSender
    from bunraku.client.stage_output import StageOutput
    from bunraku.client.viewer import Viewer

send = typer.Typer(help="Send a session to other tools, until Ctrl-C.", no_args_is_help=True)

SessionArgument = Annotated[str, typer.Argument(help="Id or address of a session.")]
SecondsOption = Annotated[float | None, typer.Option(help="Duration; default: until Ctrl-C.", min=0.1)]
FpsOption = Annotated[float, typer.Option("--fps", help="Frames per second.", min=1, max=240)]
SingleOption = Annotated[
    bool, typer.Option("--single", help="Send each OSC message by itself, for receivers without bundles.")
]


class DmxProtocol(Enum):
    """Network protocol of DMX levels."""

    SACN = "sacn"
    ARTNET = "artnet"

    @property
    def label(self) -> str:
        """Name of the protocol in messages."""
        return {"sacn": "sACN", "artnet": "Art-Net"}[self.value]


@send.command("vmc")
def send_vmc(
    session: SessionArgument,
    to: Annotated[str, typer.Option(help="HOST:PORT of the receiver; default port 39539.")],
    performer: Annotated[int, typer.Option(help="Number of the performer, from 0.", min=0, max=3)] = 0,
    fps: FpsOption = 60.0,
    single: SingleOption = False,
    scale: Annotated[
        float,
        typer.Option(
            help="Factor of all positions: height of the avatar's hips / the figure's.",
            min=0.01,
            max=100,
        ),
    ] = 1.0,
    root_motion: Annotated[
        bool, typer.Option("--root-motion", help="Move the root, for receivers that ignore positions of bones.")
    ] = False,
    seconds: SecondsOption = None,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Send a performer's pose to VSeeFace, Warudo, VNyan, Unity, Unreal or Blender by the VMC protocol."""
    from bunraku.client.stage_output import VmcOutput
    from bunraku.output import vmc

    def make_output(viewer: Viewer, sender: DatagramSender) -> StageOutput:
        return VmcOutput(viewer, sender.send, performer=performer, single=single, scale=scale, root_motion=root_motion)

    send_session(
        make_output,
        "VMC",
        _parse_target(to, vmc.DEFAULT_PORT),
        SendOptions(session, fps, seconds, server, token, as_json),
    )


@send.command("osc")
def send_osc(
    session: SessionArgument,
    to: Annotated[str, typer.Option(help="HOST:PORT of the receiver.")],
    fps: FpsOption = 60.0,
    single: SingleOption = False,
    seconds: SecondsOption = None,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Send the lights and the positions of the limbs as OSC messages."""
    from bunraku.client.stage_output import OscOutput

    def make_output(viewer: Viewer, sender: DatagramSender) -> StageOutput:
        return OscOutput(viewer, sender.send, single=single)

    send_session(
        make_output,
        "OSC",
        _parse_target(to, None),
        SendOptions(session, fps, seconds, server, token, as_json),
    )


@send.command("dmx")
def send_dmx(
    session: SessionArgument,
    protocol: Annotated[DmxProtocol, typer.Option(help="Network protocol.")] = DmxProtocol.SACN,
    to: Annotated[
        str | None, typer.Option(help="HOST or HOST:PORT of the node; default for sACN: the universe's multicast.")
    ] = None,
    universe: Annotated[int, typer.Option(help="Universe: sACN 1..63999, Art-Net 0..32767.")] = 1,
    address: Annotated[int, typer.Option(help="First slot of the first light.", min=1, max=dmx.SLOT_COUNT)] = 1,
    layout: Annotated[
        str, typer.Option(help="Slots of a light, in order: d (dimmer), r, g, b, each at most once.")
    ] = "drgb",
    priority: Annotated[int, typer.Option(help="Priority of sACN.", min=0, max=sacn.MAX_PRIORITY)] = (
        sacn.DEFAULT_PRIORITY
    ),
    fps: Annotated[
        float,
        typer.Option("--fps", help="Packets per second at most.", min=1, max=dmx.MAX_FPS),
    ] = 40.0,
    seconds: SecondsOption = None,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Send the lights as DMX levels by sACN (E1.31) or Art-Net."""
    from bunraku.client.stage_output import DmxOutput, pack_artnet, pack_sacn

    is_sacn = protocol is DmxProtocol.SACN
    low, high = (sacn.MIN_UNIVERSE, sacn.MAX_UNIVERSE) if is_sacn else (0, artnet.MAX_UNIVERSE)
    if not low <= universe <= high:
        raise typer.BadParameter(f"a universe of {protocol.label} is {low}..{high}", param_hint="--universe")
    try:
        slots = dmx.Universe(address, layout)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--layout") from None
    if to is None and not is_sacn:
        raise typer.BadParameter("Art-Net needs the address of the node or of the broadcast", param_hint="--to")
    default_port = sacn.DEFAULT_PORT if is_sacn else artnet.DEFAULT_PORT
    target = _parse_target(to or sacn.multicast_address(universe), default_port)
    pack = pack_sacn(universe, priority, uuid.uuid4().bytes) if is_sacn else pack_artnet(universe)

    def make_output(viewer: Viewer, sender: DatagramSender) -> StageOutput:
        final_packets = sacn.TERMINATION_PACKETS if is_sacn else 0
        return DmxOutput(viewer, sender.send, slots, pack, final_packets=final_packets)

    send_session(
        make_output,
        protocol.label,
        target,
        SendOptions(session, fps, seconds, server, token, as_json),
    )


def _parse_target(address: str, default_port: int | None) -> tuple[str, int]:
    from bunraku.client.datagram import AddressError, parse_address

    try:
        return parse_address(address, default_port)
    except AddressError as error:
        raise typer.BadParameter(str(error), param_hint="--to") from None
