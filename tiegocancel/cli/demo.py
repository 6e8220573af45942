"""``tiegocancel demo``: the main job on the built-in scene, without any data."""

from __future__ import annotations

import argparse
from typing import Any

from tiegocancel.cli.settings import add_cancel_options, add_estimate_options, add_output_options, settings_from

__all__ = ["DEMO", "add_parser", "run"]

DEMO: dict[str, dict[str, Any]] = {
    # Long enough that the rim moves many gates ahead, so that neither chance nor "same place" can explain a match.
    "cancel": {"horizon_us": 40_000, "ring_capacity": 1 << 18},
    "motion": {"source": "truth"},
    "simulate": {"duration_s": 0.4, "seed": 1},
}
"""The demo's operating point, as a configuration file would say it."""

_FIT_SAMPLE_S = 0.1


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
    return session.run(
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
