"""Speak our own framed protocol, for people who design a device; ``framed.md`` beside this folder specifies it."""

from __future__ import annotations

from tiegocancel.link.protocols.framed.decoder import FramedDecoder
from tiegocancel.link.protocols.framed.device import FramedDevice
from tiegocancel.link.protocols.framed.encoder import FramedEncoder
from tiegocancel.link.protocols.framed.host import FramedHost
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["FramedDecoder", "FramedEncoder", "FramedHost", "decoder", "device", "encoder", "host"]


def decoder(options: ProtocolOptions) -> FramedDecoder:
    """Return a decoder."""
    return FramedDecoder(options)


def encoder(options: ProtocolOptions) -> FramedEncoder:
    """Return an encoder."""
    return FramedEncoder(options)


def host(options: ProtocolOptions) -> FramedHost:
    """Return a host that grants any number of frames."""
    return FramedHost(options)


def device(options: ProtocolOptions) -> FramedDevice:
    """Return a device of ``options.width`` and ``options.height``."""
    return FramedDevice(options)
