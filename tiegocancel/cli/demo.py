"""``tiegocancel demo``: the main job on the built-in scene, without any data."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING, Any

from tiegocancel.cli.settings import add_cancel_options, add_estimate_options, add_output_options, settings_from

if TYPE_CHECKING:
    from tiegocancel.study.settings import Settings

__all__ = ["DEMO", "add_parser", "run"]

DEMO: dict[str, dict[str, Any]] = {
    # Long enough that the rim moves many gates ahead, so that neither chance nor "same place" can explain a match.
    "cancel": {"horizon_us": 40_000, "ring_capacity": 1 << 18},
    "motion": {"source": "truth"},
    "simulate": {"duration_s": 0.4, "seed": 1},
}
"""The demo's operating point, as a configuration file would say it."""

_FIT_SAMPLE_S = 0.1

_PARTS = ("ecp5-45f", "rp2040")
"""Parts that the demo judges: one that takes the scene's 3.8 Mev/s, and one that does not."""
_JUDGED_S = 0.012
"""Longer than the horizon of the preset that they are judged with, so that rings and table are at work."""
_JUDGED_PRESET = "lean"


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "demo",
        help="cancel the ego-motion of the built-in scene",
        description="Simulate a textured disc that turns and a mover that crosses it, then cancel the ego-motion.",
    )
    parser.add_argument("--duration", type=float, metavar="S", help="seconds of the scene (0.4)")
    parser.add_argument("--seed", type=int, metavar="N", help="seed of the scene's sensor (1)")
    parser.add_argument("--motion", metavar="M", help="truth (default), fit, track, CX,CY,OMEGA, a CSV or a schedule")
    add_cancel_options(parser)
    add_estimate_options(parser)
    add_output_options(parser)
    parser.add_argument(
        "--no-budget", dest="budget", action="store_false", default=True, help="do not judge two parts on the scene"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    settings = settings_from(args, DEMO)
    from tiegocancel.cli.session import Session
    from tiegocancel.events import Events
    from tiegocancel.scene import ground_truth, photograph, simulate
    from tiegocancel.study.feed import FixedMotion
    from tiegocancel.study.motion_source import Found, motion_inputs, open_motion

    scene, duration_s, seed = settings.scene, settings.simulate.duration_s, settings.simulate.seed
    if settings.motion.source == "truth":
        found = Found(FixedMotion(ground_truth(scene, duration_s=duration_s)))
    else:
        found = open_motion(
            settings,
            sample=lambda: Events.concatenate(
                [
                    Events.empty(scene.width, scene.height, labelled=True),
                    *simulate(scene, duration_s=min(duration_s, _FIT_SAMPLE_S), seed=seed),
                ]
            ),
            width=scene.width,
            height=scene.height,
        )
    session = Session(
        args, settings, title="Built-in scene: a textured disc and a mover", inputs=motion_inputs(settings)
    )
    code = session.run(
        simulate(scene, duration_s=duration_s, seed=seed),
        found,
        width=scene.width,
        height=scene.height,
        disc_radius_px=scene.rig.radius_px,
        labelled=True,
        notes=[],
        expected_us=round(duration_s * 1e6),
        photograph=photograph(scene, time_s=duration_s / 2),
    )
    if code == 0 and args.budget and not args.json:
        sys.stdout.write(_budget(settings))
    return code


def _budget(settings: Settings) -> str:
    """Return the verdicts on two parts for the first milliseconds of the scene, as a table."""
    from dataclasses import replace

    from tiegocancel.cli.progress import event_progress
    from tiegocancel.firmware_sim.target import load_target
    from tiegocancel.matching.config import CancelConfig
    from tiegocancel.matching.presets import preset_table
    from tiegocancel.scene import ground_truth, simulate
    from tiegocancel.study.budget.ground import gather
    from tiegocancel.study.budget.judge import judge_target
    from tiegocancel.study.budget.text import comparison
    from tiegocancel.study.feed import FixedMotion

    scene, seed = settings.scene, settings.simulate.seed
    table = preset_table(_JUDGED_PRESET, "demo")
    cancel = CancelConfig(**{**table, "set_bits": tuple(table["set_bits"])})
    ground = gather(
        simulate(scene, duration_s=_JUDGED_S, seed=seed),
        FixedMotion(ground_truth(scene, duration_s=_JUDGED_S)),
        most=settings.budget.most_events,
        step_us=settings.motion.schedule_step_us,
    )
    if ground is None:
        return ""
    core, budget = replace(settings.core, input_depth=1024), replace(settings.budget, changes=False)
    judged = []
    for name in _PARTS:
        with event_progress(f"judging {name}", None):
            judged.append(judge_target(ground, load_target(name), cancel, core, budget))
    head = (
        f"\ntwo parts on the first {_JUDGED_S * 1e3:g} ms ({len(ground.events):,} events), preset {_JUDGED_PRESET}; "
        "tiegocancel budget tells more:\n"
    )
    return head + comparison(judged, cancelled=False)
