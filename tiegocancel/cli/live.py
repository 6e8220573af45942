"""Run on a live link: what ``run`` does when its source is a port."""

from __future__ import annotations

import argparse
import contextlib
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tiegocancel.cli.link_options import limits_from, line_from, protocol_from, queue_from
from tiegocancel.cli.settings import settings_from
from tiegocancel.errors import ConfigError

if TYPE_CHECKING:
    from tiegocancel.estimation.inertial.live import LiveGyro
    from tiegocancel.estimation.paced import PacedEstimator
    from tiegocancel.events import Events
    from tiegocancel.link.live_view import LiveView
    from tiegocancel.link.source import LinkSource
    from tiegocancel.study.motion_source import Found
    from tiegocancel.study.settings import Settings

__all__ = ["run_link"]

_GYRO_OF_LINK = "link"
_GYRO_BITMAP = 1024


def run_link(args: argparse.Namespace) -> int:
    """Open the link, find out its sensor, run until it ends, and report."""
    settings = settings_from(args, {"motion": {"source": "track"}})
    _check(args, settings)
    from tiegocancel.cli.session import Session
    from tiegocancel.link.forward import Forward
    from tiegocancel.link.opening import open_output
    from tiegocancel.link.protocols import registry
    from tiegocancel.link.source import LinkSource
    from tiegocancel.study.live import warm_up
    from tiegocancel.study.motion_source import motion_inputs

    with_gyro = settings.estimate.gyro == _GYRO_OF_LINK
    options = protocol_from(args, sensor_bitmap=_GYRO_BITMAP if with_gyro else 0)
    line = line_from(args)
    gyro = _live_gyro(settings) if with_gyro else None
    link = LinkSource(
        args.source, args.protocol, line=line, queue=queue_from(args), options=options, limits=limits_from(args)
    )
    expected = (link.decoder.width, link.decoder.height)

    def prepare(width: int, height: int) -> None:
        """Compile for a sensor; of one that no protocol and no flag has told, once it is known."""
        if min(width, height) > 1:
            warm_up(settings, _motion(settings, gyro, width, height).feed, width=width, height=height)

    prepare(*expected)
    with contextlib.ExitStack() as stack, link:
        width, height = link.wait_for_size()
        if (width, height) != expected:
            prepare(width, height)
        if link.banner:
            sys.stderr.write(f"note: {args.source}: {link.banner.splitlines()[0]}, {width}×{height} px\n")
        if gyro is not None:
            link.on_lines = lambda lines: gyro.add((said.t_us, said.text) for said in lines)
        found = _motion(settings, gyro, width, height)
        paced = _paced(found, args.source)
        sinks = []
        if args.residual_to is not None:
            onward = replace(line, baud=args.residual_baud or line.baud)
            sized = replace(options, width=width, height=height)
            forward = Forward(open_output(args.residual_to, onward), registry.encoder(args.protocol, sized))
            sinks.append(stack.enter_context(forward).write)
        inputs = [file for file in [Path(args.source), *motion_inputs(settings)] if file.is_file()]
        session = Session(args, settings, title=args.source, inputs=inputs)
        view = None if args.view is None and not args.live else stack.enter_context(_view(args, link))
        more_notes = list if paced is None else paced.notes
        return session.run_link(link, found, width=width, height=height, sinks=sinks, watch=view, more_notes=more_notes)


def _view(args: argparse.Namespace, link: LinkSource) -> LiveView:
    """Return the view: in a window where there is a display, otherwise in the terminal."""
    from tiegocancel.link.live_view import LiveView
    from tiegocancel.link.screen_process import ScreenProcess
    from tiegocancel.link.window_screen import has_display

    in_window = args.view == "window" or (args.view in (None, "auto") and has_display())
    return LiveView(ScreenProcess(f"tiegocancel.link.{'window' if in_window else 'terminal'}_screen"), link)


def _check(args: argparse.Namespace, settings: Settings) -> None:
    """Refuse what cannot be done on a link."""
    if args.protocol is None:
        raise ConfigError(f"{args.source} is a port: say what it speaks with --protocol")
    if settings.motion.source.strip().lower() == "fit":
        raise ConfigError("--motion fit: looks at a recording beforehand; on a link use track, gyro, numbers or a file")
    for name in ("undistort", "time_unit", "columns", "format"):
        if getattr(settings.read, name) is not None:
            raise ConfigError(f"--{name.replace('_', '-')}: says how a recording is read, and serves no link")
    if settings.motion.refine:
        raise ConfigError("--refine: looks at a recording beforehand, and a link has none")
    if args.to is not None:
        raise ConfigError(f"--to {args.to}: a device in the loop is sent a recording, not a live link")
    if args.residual_to == "-" and args.json:
        raise ConfigError("--residual-to -: standard output takes either the events or --json")


def _live_gyro(settings: Settings) -> LiveGyro:
    """Return the gyroscope whose lines come over the link."""
    from tiegocancel.estimation.inertial.live import LiveGyro

    if settings.estimate.calibration is not None:
        raise ConfigError("--calibration: serves a gyroscope in a file, not the one of the link")
    try:
        return LiveGyro(axes=settings.estimate.gyro_axes, offset_us=settings.estimate.gyro_offset_us)
    except ValueError as error:
        raise ConfigError(f"--gyro-axes: {error}") from None


def _motion(settings: Settings, gyro: LiveGyro | None, width: int, height: int) -> Found:
    """Return the feed of the motion; of the link's own gyroscope where that is asked for."""
    from tiegocancel.study.feed import TrackedMotion
    from tiegocancel.study.motion_source import Found, open_motion

    if gyro is None:
        return open_motion(settings, sample=_no_sample, width=width, height=height)
    from tiegocancel.estimation.estimate import Estimator
    from tiegocancel.estimation.inertial.fusion import ExponentialConfig, ExponentialFusion, Fusion, KalmanFusion
    from tiegocancel.estimation.inertial.live import LiveFusedEstimator, LiveGyroEstimator
    from tiegocancel.study.estimators import build_estimator

    estimate = settings.estimate
    source = settings.motion.source.strip().lower()
    if source not in ("track", "gyro"):
        raise ConfigError(f"--gyro {_GYRO_OF_LINK}: serves --motion track and --motion gyro, not {source}")
    rests = estimate.gyro_bias == "rest"
    estimator: Estimator
    if source == "gyro" or estimate.method == "gyro":
        estimator = LiveGyroEstimator(gyro, (0.5 * (width - 1), 0.5 * (height - 1)), follow_bias=rests)
        return Found(TrackedMotion(estimator, source="gyro of the link"))
    of_events = build_estimator(replace(estimate, gyro=None), width=width, height=height)
    kalman = estimate.fusion == "kalman"
    fusion: Fusion = KalmanFusion()
    if not kalman:
        fusion = ExponentialFusion(ExponentialConfig(alpha=estimate.alpha, event_alpha=estimate.alpha))
    estimator = LiveFusedEstimator(of_events, gyro, fusion, follow_bias=rests)
    return Found(TrackedMotion(estimator, source="track, gyro of the link"))


def _paced(found: Found, source: str) -> PacedEstimator | None:
    """Keep a motion that is found on the way in time with a port; bytes of a file wait for it."""
    from tiegocancel.estimation.paced import PacedEstimator
    from tiegocancel.link.opening import is_port
    from tiegocancel.study.feed import TrackedMotion

    if source == "-" or not is_port(source) or not isinstance(found.feed, TrackedMotion):
        return None
    return found.feed.wrapped(PacedEstimator)


def _no_sample() -> Events:
    raise ConfigError("a link gives no sample beforehand")
