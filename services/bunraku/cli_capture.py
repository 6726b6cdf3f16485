"""Commands that receive live motion from capture tools: `bunraku capture`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bunraku.terminal import DEFAULT_SERVER, JsonOption, ServerOption, TokenOption, parse_resource_address

if TYPE_CHECKING:
    from bunraku.capture.frame import FrameAssembler
    from bunraku.capture_stream import StreamOptions

capture = typer.Typer(
    help="Record the live motion of a capture tool as a BVH file, stream it to a server, or both.", no_args_is_help=True
)

FileArgument = Annotated[Path | None, typer.Argument(help="New BVH file.", show_default=False)]
HostOption = Annotated[str, typer.Option(help="Address to listen at; 0.0.0.0 for tools on other machines.")]
FpsOption = Annotated[float, typer.Option("--fps", help="Frames per second of file and motion.", min=1, max=240)]
SecondsOption = Annotated[float | None, typer.Option(help="Duration; default: until Ctrl-C.", min=0.1)]
TargetOption = Annotated[str | None, typer.Option("--server", help="Stream to the server at this address.")]
SessionOption = Annotated[
    str | None, typer.Option(help="Id or address of the session to join; default: a new one.", show_default=False)
]
NameOption = Annotated[str, typer.Option(help="Name of the performer.", show_default=False)]
PlaceOption = Annotated[
    str | None,
    typer.Option(metavar="X,Z,TURN", help="Place on the stage, metres and degrees; default: the next free one."),
]


def _port(default: int) -> typer.models.OptionInfo:
    option: typer.models.OptionInfo = typer.Option(help=f"UDP port; default {default}.", min=1, max=65535)
    return option


@capture.command("vmc")
def capture_vmc(
    file: FileArgument = None,
    host: HostOption = "127.0.0.1",
    port: Annotated[int, _port(39539)] = 39539,
    fps: FpsOption = 60.0,
    seconds: SecondsOption = None,
    server: TargetOption = None,
    session: SessionOption = None,
    name: NameOption = "",
    place: PlaceOption = None,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Capture a performer of the VMC protocol: VSeeFace, Warudo, XR Animator, Virtual Motion Capture and others."""
    from bunraku.capture.vmc import VmcAssembler

    stream = _parse_stream(server, session, name, place, token, fps)
    _capture(VmcAssembler(), "VMC", (host, port), file, stream, fps, seconds, as_json)


@capture.command("xsens")
def capture_xsens(
    file: FileArgument = None,
    character: Annotated[int | None, typer.Option(help="Id of the character; default: the first.", min=0)] = None,
    host: HostOption = "127.0.0.1",
    port: Annotated[int, _port(9763)] = 9763,
    fps: FpsOption = 60.0,
    seconds: SecondsOption = None,
    server: TargetOption = None,
    session: SessionOption = None,
    name: NameOption = "",
    place: PlaceOption = None,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Capture Xsens MVN's network stream, type 02 (position and quaternion)."""
    from bunraku.capture.mvn import MvnAssembler

    stream = _parse_stream(server, session, name, place, token, fps)
    _capture(MvnAssembler(character), "MVN", (host, port), file, stream, fps, seconds, as_json)


@capture.command("rokoko")
def capture_rokoko(
    file: FileArgument = None,
    actor: Annotated[str | None, typer.Option(help="Name of the actor; default: the first.")] = None,
    host: HostOption = "127.0.0.1",
    port: Annotated[int, _port(14043)] = 14043,
    fps: FpsOption = 60.0,
    seconds: SecondsOption = None,
    server: TargetOption = None,
    session: SessionOption = None,
    name: NameOption = "",
    place: PlaceOption = None,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Capture Rokoko Studio's custom stream, JSON version 3, plain or LZ4."""
    from bunraku.capture.rokoko import RokokoAssembler

    stream = _parse_stream(server, session, name, place, token, fps)
    _capture(RokokoAssembler(actor), "Rokoko JSON", (host, port), file, stream, fps, seconds, as_json)


@capture.command("osc")
def capture_osc(
    mapping: Annotated[Path, typer.Option(help="Mapping file: which address is which bone.", exists=True)],
    port: Annotated[int, typer.Option(help="UDP port.", min=1, max=65535)],
    file: FileArgument = None,
    host: HostOption = "127.0.0.1",
    fps: FpsOption = 60.0,
    seconds: SecondsOption = None,
    server: TargetOption = None,
    session: SessionOption = None,
    name: NameOption = "",
    place: PlaceOption = None,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Capture OSC messages of any tool by a mapping file."""
    from bunraku.capture.errors import UnreadableCapture
    from bunraku.capture.osc_capture import OscAssembler
    from bunraku.capture.osc_mapping import MAX_MAPPING_BYTES, parse_mapping

    try:
        with mapping.open("rb") as opened:
            parsed = parse_mapping(opened.read(MAX_MAPPING_BYTES + 1))
    except OSError as error:
        raise typer.BadParameter(f"{mapping}: {error.strerror}", param_hint="--mapping") from None
    except UnreadableCapture as error:
        raise typer.BadParameter(f"{mapping}: {error}", param_hint="--mapping") from None
    stream = _parse_stream(server, session, name, place, token, fps)
    _capture(OscAssembler(parsed), "OSC", (host, port), file, stream, fps, seconds, as_json)


@capture.command("bvh")
def capture_bvh(
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True, help="BVH file to play.")],
    loop: Annotated[bool, typer.Option("--loop", help="Begin again at the end, until Ctrl-C.")] = False,
    seconds: SecondsOption = None,
    server: ServerOption = DEFAULT_SERVER,
    session: SessionOption = None,
    name: NameOption = "",
    place: PlaceOption = None,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Play a BVH file in real time as a live performer, to rehearse."""
    from bunraku.capture_rehearsal import play_file

    def make_options(fps: float) -> StreamOptions:
        stream = _parse_stream(server, session, name, place, token, fps)
        assert stream is not None
        return stream

    play_file(file, make_options, loop=loop, seconds=seconds, as_json=as_json)


def _parse_stream(
    server: str | None, session: str | None, name: str, place: str | None, token: str | None, fps: float
) -> StreamOptions | None:
    """Return the options of a stream; None without a server."""
    from bunraku.capture_stream import MIN_STREAM_FPS, StreamOptions

    base, kind, session_id = parse_resource_address(session) if session is not None else (None, None, None)
    if kind == "motions":
        raise typer.BadParameter("this is the address of a motion; give a session", param_hint="--session")
    server = base or server
    if server is None:
        given = {"--session": session is not None, "--name": bool(name), "--place": place is not None}
        for option, is_given in given.items():
            if is_given:
                raise typer.BadParameter("give the server too, with --server", param_hint=option)
        return None
    fps = max(fps, MIN_STREAM_FPS)
    return StreamOptions(server, token, session_id, name, fps, None if place is None else _parse_place(place))


def _parse_place(place: str) -> tuple[float, float, float]:
    try:
        x, z, turn = map(float, place.split(","))
    except ValueError:
        x = z = turn = math.nan
    if not all(map(math.isfinite, (x, z, turn))):
        raise typer.BadParameter(f"{place} is not X,Z,TURN, such as 1.5,0,90", param_hint="--place")
    return x, z, turn


def _capture(
    assembler: FrameAssembler,
    name: str,
    address: tuple[str, int],
    file: Path | None,
    stream: StreamOptions | None,
    fps: float,
    seconds: float | None,
    as_json: bool,
) -> None:
    from bunraku.capture_recorder import CaptureOptions, run_capture

    if file is None and stream is None:
        raise typer.BadParameter("give a new BVH file to record, --server to stream, or both", param_hint="FILE")
    run_capture(assembler, name, CaptureOptions(file, stream, address, fps, seconds, as_json))
