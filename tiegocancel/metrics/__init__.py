"""Measure what a canceller did: ratios, regions, selectivity, displacement and rate, in constant memory."""

from tiegocancel.metrics.displacement import DisplacementHistogram
from tiegocancel.metrics.ledger import Ledger, Matches, Settled
from tiegocancel.metrics.rate import RateProfile
from tiegocancel.metrics.regions import DiscRegion, estimate_radius_px
from tiegocancel.metrics.residual_profile import ResidualProfile
from tiegocancel.metrics.tally import Share, Tally

__all__ = [
    "DiscRegion",
    "DisplacementHistogram",
    "Ledger",
    "Matches",
    "RateProfile",
    "ResidualProfile",
    "Settled",
    "Share",
    "Tally",
    "estimate_radius_px",
]
