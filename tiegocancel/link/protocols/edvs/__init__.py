"""Speak the protocol of the eDVS and Mini-eDVS: events between lines of text, commands in ASCII."""

from __future__ import annotations

from tiegocancel.link.protocols.edvs.decoder import EdvsDecoder
from tiegocancel.link.protocols.edvs.delta_decoder import EdvsDeltaDecoder
from tiegocancel.link.protocols.edvs.device import EdvsDevice
from tiegocancel.link.protocols.edvs.encoder import EdvsEncoder
from tiegocancel.link.protocols.edvs.host import EdvsHost
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["decoder", "device", "encoder", "host"]


def decoder(options: ProtocolOptions) -> EdvsDecoder | EdvsDeltaDecoder:
    """Return a decoder of ``options.edvs_format``."""
    return EdvsDeltaDecoder(options) if options.edvs_format == "E1" else EdvsDecoder(options)


def encoder(options: ProtocolOptions) -> EdvsEncoder:
    """Return an encoder of ``options.edvs_format``."""
    return EdvsEncoder(options)


def host(options: ProtocolOptions) -> EdvsHost:
    """Return a host that asks for ``options.edvs_format``."""
    return EdvsHost(options)


def device(options: ProtocolOptions) -> EdvsDevice:
    """Return a device that begins in ``options.edvs_format``."""
    return EdvsDevice(options)
