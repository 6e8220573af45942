"""Speak the lines that an OpenMV camera with a GENX320 prints: ``C <events> <base64>`` between two markers."""

from __future__ import annotations

from tiegocancel.link.protocols.openmv.decoder import OpenMvDecoder
from tiegocancel.link.protocols.openmv.device import OpenMvDevice
from tiegocancel.link.protocols.openmv.encoder import OpenMvEncoder
from tiegocancel.link.protocols.openmv.host import OpenMvHost
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["decoder", "device", "encoder", "host"]


def decoder(options: ProtocolOptions) -> OpenMvDecoder:
    """Return a decoder."""
    return OpenMvDecoder(options)


def encoder(options: ProtocolOptions) -> OpenMvEncoder:
    """Return an encoder."""
    return OpenMvEncoder(options)


def host(options: ProtocolOptions) -> OpenMvHost:
    """Return a host."""
    return OpenMvHost()


def device(options: ProtocolOptions) -> OpenMvDevice:
    """Return a device."""
    return OpenMvDevice(options)
