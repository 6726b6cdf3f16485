"""Commands that receive live motion from capture tools: `bunraku capture`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bunraku.terminal import JsonOption

if TYPE_CHECKING:
    from bunraku.capture.frame import FrameAssembler

capture = typer.Typer(help="Record the live motion of a capture tool as a BVH file.", no_args_is_help=True)

FileArgument = Annotated[Path, typer.Argument(help="New BVH file.")]
HostOption = Annotated[str, typer.Option(help="Address to listen at; 0.0.0.0 for tools on other machines.")]
FpsOption = Annotated[float, typer.Option("--fps", help="Frames per second of the file.", min=1, max=240)]
SecondsOption = Annotated[float | None, typer.Option(help="Duration of the take; default: until Ctrl-C.", min=0.1)]


def _port(default: int) -> typer.models.OptionInfo:
    option: typer.models.OptionInfo = typer.Option(help=f"UDP port; default {default}.", min=1, max=65535)
    return option


@capture.command("vmc")
def capture_vmc(
    file: FileArgument,
    host: HostOption = "127.0.0.1",
    port: Annotated[int, _port(39539)] = 39539,
    fps: FpsOption = 60.0,
    seconds: SecondsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Record a performer of the VMC protocol: VSeeFace, Warudo, XR Animator, Virtual Motion Capture and others."""
    from bunraku.capture.vmc import VmcAssembler

    _record(VmcAssembler(), "VMC", (host, port), file, fps, seconds, as_json)


@capture.command("xsens")
def capture_xsens(
    file: FileArgument,
    character: Annotated[int | None, typer.Option(help="Id of the character; default: the first.", min=0)] = None,
    host: HostOption = "127.0.0.1",
    port: Annotated[int, _port(9763)] = 9763,
    fps: FpsOption = 60.0,
    seconds: SecondsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Record Xsens MVN's network stream, type 02 (position and quaternion)."""
    from bunraku.capture.mvn import MvnAssembler

    _record(MvnAssembler(character), "MVN", (host, port), file, fps, seconds, as_json)


@capture.command("rokoko")
def capture_rokoko(
    file: FileArgument,
    actor: Annotated[str | None, typer.Option(help="Name of the actor; default: the first.")] = None,
    host: HostOption = "127.0.0.1",
    port: Annotated[int, _port(14043)] = 14043,
    fps: FpsOption = 60.0,
    seconds: SecondsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Record Rokoko Studio's custom stream, JSON version 3, plain or LZ4."""
    from bunraku.capture.rokoko import RokokoAssembler

    _record(RokokoAssembler(actor), "Rokoko JSON", (host, port), file, fps, seconds, as_json)


@capture.command("osc")
def capture_osc(
    file: FileArgument,
    mapping: Annotated[Path, typer.Option(help="Mapping file: which address is which bone.", exists=True)],
    port: Annotated[int, typer.Option(help="UDP port.", min=1, max=65535)],
    host: HostOption = "127.0.0.1",
    fps: FpsOption = 60.0,
    seconds: SecondsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Record OSC messages of any tool by a mapping file."""
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
    _record(OscAssembler(parsed), "OSC", (host, port), file, fps, seconds, as_json)


def _record(
    assembler: FrameAssembler,
    name: str,
    address: tuple[str, int],
    file: Path,
    fps: float,
    seconds: float | None,
    as_json: bool,
) -> None:
    from bunraku.capture_recorder import record_take

    record_take(assembler, name, address, file, fps=fps, seconds=seconds, as_json=as_json)
