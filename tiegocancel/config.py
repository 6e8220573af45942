"""Fill frozen dataclasses from TOML tables; an unknown key is an error that names the nearest one."""

from __future__ import annotations

import dataclasses
import difflib
import tomllib
import types
import typing
from pathlib import Path
from typing import Any, TypeVar

from tiegocancel.errors import ConfigError

__all__ = ["fill", "load_toml"]

T = TypeVar("T")


def load_toml(path: str | Path) -> dict[str, Any]:
    """Read a TOML file; raise :class:`ConfigError` naming the file and what is wrong in it."""
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from error


def fill(cls: type[T], table: dict[str, Any], where: str) -> T:
    """Build the dataclass ``cls`` from ``table``, nested dataclasses from nested tables.

    ``where`` names the table in messages, for example ``run.toml [cancel]``. Raise :class:`ConfigError` for unknown
    keys, wrong types and values that the dataclass refuses.
    """
    hints = typing.get_type_hints(cls)
    fields = {field.name: field for field in dataclasses.fields(cls) if field.init}  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for key, value in table.items():
        if key not in fields:
            near = difflib.get_close_matches(key, fields, n=1, cutoff=0.4)
            hint = f"; did you mean {near[0]!r}?" if near else f"; known keys: {', '.join(fields)}"
            raise ConfigError(f"{where}: unknown key {key!r}{hint}")
        place = f"{where} [{key}]" if isinstance(value, dict) else f"{where} {key}"
        values[key] = _convert(hints[key], value, place)
    try:
        return cls(**values)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{where}: {error}") from error


def _convert(hint: Any, value: Any, where: str) -> Any:
    """Check ``value`` against the field's type; whole numbers pass for floats, lists for tuples."""
    options = typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
    for option in options:
        origin = typing.get_origin(option)
        if dataclasses.is_dataclass(option) and isinstance(value, dict):
            return fill(option, value, where)  # type: ignore[arg-type]
        if origin is tuple and isinstance(value, list):
            kinds = typing.get_args(option)
            if kinds and kinds[-1] is Ellipsis:
                return tuple(_convert(kinds[0], item, where) for item in value)
            if len(kinds) == len(value):
                return tuple(_convert(kind, item, where) for kind, item in zip(kinds, value, strict=True))
        if origin is typing.Literal and value in typing.get_args(option):
            return value
        if option is float and isinstance(value, int | float) and not isinstance(value, bool):
            return float(value)
        if isinstance(option, type) and isinstance(value, option) and (option is bool or not isinstance(value, bool)):
            return value
    raise ConfigError(f"{where} must be {_name(hint)}, not {value!r}")


def _name(hint: Any) -> str:
    """Return the type in words that fit a TOML file."""
    if typing.get_origin(hint) is typing.Literal:
        return "one of " + ", ".join(repr(choice) for choice in typing.get_args(hint))
    return getattr(hint, "__name__", str(hint)) if typing.get_origin(hint) is None else str(hint)
