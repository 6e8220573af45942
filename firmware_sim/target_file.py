"""Read target files: TOML in, frozen dataclasses out, one clear line for a fault."""

from __future__ import annotations

import dataclasses
import difflib
import typing
from pathlib import Path
from typing import Any, TypeVar

from tiegocancel.config import fill, load_toml
from tiegocancel.errors import ConfigError

__all__ = ["kind_of", "read_target_file"]

T = TypeVar("T")


def kind_of(table: dict[str, Any], path: Path) -> str:
    """Return the file's ``kind``; raise :class:`ConfigError` where it is none of the three."""
    kind = table.get("kind")
    if kind not in ("fpga", "mcu", "memory"):
        raise ConfigError(f"{path} kind must be one of 'fpga', 'mcu', 'memory', not {kind!r}")
    return str(kind)


def read_target_file(path: Path, classes: dict[str, type[T]]) -> T:
    """Read ``path`` into the class that ``classes`` gives for its ``kind``.

    Raise :class:`ConfigError` in one line: file, table, field, value, and for an unknown key the nearest one.
    """
    table = load_toml(path)
    kind = kind_of(table, path)
    if kind not in classes:
        raise ConfigError(f"{path} kind must be one of {', '.join(map(repr, classes))} here, not {kind!r}")
    return _build(classes[kind], table, str(path))


def _build(cls: type[T], table: dict[str, Any], where: str) -> T:
    """Fill ``cls``; tables of a list are named by their ``name`` or place, and ``sources`` becomes pairs."""
    hints = typing.get_type_hints(cls)
    fields = {field.name: field for field in dataclasses.fields(cls) if field.init}  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for key, value in table.items():
        inner = _table_class(hints.get(key))
        if key == "sources" and key in fields:
            values[key] = _pairs(value, set(fields) - {"source", "sources"}, where)
        elif inner is not None and isinstance(value, dict):
            values[key] = _build(inner, value, f"{where} [{key}]")
        elif inner is not None and isinstance(value, list):
            values[key] = [
                _build(inner, item, f"{where} [[{key}]] {item.get('name', item.get('grade', index))!s}")
                if isinstance(item, dict)
                else item
                for index, item in enumerate(value, start=1)
            ]
        else:
            values[key] = value
    missing = [
        name
        for name, field in fields.items()
        if name not in table and field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
    ]
    unknown = [key for key in table if key not in fields]
    if missing and not unknown:
        raise ConfigError(f"{where}: {missing[0]!r} is missing")
    return fill(cls, values, where)


def _table_class(hint: Any) -> type[Any] | None:
    """Return the dataclass that a field holds, alone, optionally or in a tuple; None where it holds none."""
    for option in (hint, *typing.get_args(hint)):
        if isinstance(option, type) and dataclasses.is_dataclass(option):
            return option
    return None


def _pairs(value: Any, fields: set[str], where: str) -> list[list[str]]:
    """Turn ``sources.field = "document"`` into pairs."""
    if not isinstance(value, dict):
        raise ConfigError(f"{where} sources must be a table of field = document, not {value!r}")
    for key, text in value.items():
        if key not in fields:
            near = difflib.get_close_matches(key, fields, n=1, cutoff=0.4)
            hint = f"; did you mean {near[0]!r}?" if near else f"; known fields: {', '.join(sorted(fields))}"
            raise ConfigError(f"{where} sources: unknown field {key!r}{hint}")
        if not isinstance(text, str):
            raise ConfigError(f"{where} sources {key} must be str, not {text!r}")
    return [[key, text] for key, text in value.items()]
