"""Parse the command line, run the verb, map errors to exit codes."""

from __future__ import annotations

import argparse
import logging
import os
import re
import sys
from collections.abc import Sequence

import tiegocancel
from tiegocancel.cli import (
    budget,
    convert,
    demo,
    emulate,
    export,
    info,
    link,
    motion,
    plan,
    ports,
    record,
    replay,
    run,
    simulate,
    study_thesis,
    targets,
)
from tiegocancel.errors import ConfigError, TiegoCancelError

__all__ = ["main"]

OK, FAILED, USAGE, INTERRUPTED = 0, 1, 2, 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb and return the exit code: 0 ok, 1 failed, 2 usage or configuration, 130 interrupted."""
    words = list(sys.argv[1:] if argv is None else argv)
    args = _parser().parse_args(_joined(words))
    args.command = ["tiegocancel", *words]
    logging.basicConfig(
        stream=sys.stderr, level=logging.DEBUG if args.verbose else logging.WARNING, format="%(name)s: %(message)s"
    )
    logging.getLogger("matplotlib").setLevel(logging.WARNING)
    try:
        code: int = args.run(args)
        sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        return _complain("interrupted", INTERRUPTED)
    except BrokenPipeError:
        # The reader of stdout has left; point it elsewhere so that the interpreter's own flush stays quiet.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OK
    except (TiegoCancelError, OSError, MemoryError) as error:
        if args.verbose > 1:
            raise
        return _complain(_line(error), USAGE if isinstance(error, ConfigError) else FAILED)


def _joined(argv: Sequence[str]) -> list[str]:
    """Join ``--motion -300,60,0.3``: argparse takes a value that begins with a minus for a flag."""
    words: list[str] = []
    for word in argv:
        if words and words[-1] == "--motion" and re.match(r"-[\d.]", word):
            words[-1] = f"--motion={word}"
        else:
            words.append(word)
    return words


def _line(error: Exception) -> str:
    """Say an error in one line."""
    if isinstance(error, MemoryError):
        return f"out of memory: {error}" if str(error) else "out of memory"
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return " ".join(str(error).split())


def _complain(line: str, code: int) -> int:
    sys.stderr.write(f"tiegocancel: {line}\n")
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tiegocancel",
        description="Cancel the ego-motion events of an event camera, causally and event by event.",
    )
    parser.add_argument("--version", action="version", version=f"tiegocancel {tiegocancel.__version__}")
    parser.add_argument("-v", "--verbose", action="count", default=0, help="log more; twice: tracebacks")
    verbs = parser.add_subparsers(title="verbs", metavar="VERB", required=True)
    every = (
        demo,
        run,
        plan,
        study_thesis,
        budget,
        motion,
        simulate,
        info,
        convert,
        ports,
        record,
        replay,
        emulate,
        link,
        export,
        targets,
    )
    for verb in every:
        verb.add_parser(verbs)
    return parser
