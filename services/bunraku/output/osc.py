"""Open Sound Control packets (OSC 1.0 specification): messages, and bundles of messages that take effect together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import OscMessageBuilder


def make_message(address: str, *arguments: str | int | float) -> OscMessage:
    """Return a message with arguments of the OSC types string, int32 and float32."""
    builder = OscMessageBuilder(address)
    for argument in arguments:
        kind = {str: builder.ARG_TYPE_STRING, int: builder.ARG_TYPE_INT}.get(type(argument), builder.ARG_TYPE_FLOAT)
        builder.add_arg(argument, kind)
    return builder.build()


def pack_bundle(messages: Iterable[OscMessage]) -> bytes:
    """Return one bundle whose messages take effect immediately."""
    builder = OscBundleBuilder(IMMEDIATELY)
    for message in messages:
        builder.add_content(message)
    return builder.build().dgram


def pack_datagrams(messages: Sequence[OscMessage], single: bool) -> list[bytes]:
    """Return the datagrams of a frame: one bundle, or each message by itself if `single`."""
    return [message.dgram for message in messages] if single else [pack_bundle(messages)]
