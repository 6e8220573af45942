"""Find a wire protocol by its name; its code is imported when it is asked for."""

from __future__ import annotations

from difflib import get_close_matches
from importlib import import_module
from typing import Any

from tiegocancel.errors import ConfigError
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.protocols.protocol import Decoder, Device, Encoder, Host

__all__ = ["NAMES", "decoder", "device", "encoder", "host"]

NAMES = ("edvs", "evt2", "evt3", "openmv", "framed")
"""Each is a module or package here with functions ``decoder``, ``encoder``, ``host`` and ``device`` of the options."""


def decoder(name: str, options: ProtocolOptions | None = None) -> Decoder:
    """Return a decoder of the protocol ``name``; an unknown name raises :class:`ConfigError`."""
    made: Decoder = _wire(name).decoder(options or ProtocolOptions())
    return made


def encoder(name: str, options: ProtocolOptions | None = None) -> Encoder:
    """Return an encoder of the protocol ``name``."""
    made: Encoder = _wire(name).encoder(options or ProtocolOptions())
    return made


def host(name: str, options: ProtocolOptions | None = None) -> Host:
    """Return the host's side of the conversation of the protocol ``name``."""
    made: Host = _wire(name).host(options or ProtocolOptions())
    return made


def device(name: str, options: ProtocolOptions | None = None) -> Device:
    """Return the device's side of the conversation of the protocol ``name``."""
    made: Device = _wire(name).device(options or ProtocolOptions())
    return made


def _wire(name: str) -> Any:
    if name not in NAMES:
        near = get_close_matches(name, NAMES, 1)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise ConfigError(f"protocol must be one of {', '.join(NAMES)}, not {name!r}{hint}")
    return import_module(f"tiegocancel.link.protocols.{name}")
