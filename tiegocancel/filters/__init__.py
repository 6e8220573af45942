"""Take hot pixels, flicker and noise out of a stream before it is cancelled: causally, in constant memory."""

from tiegocancel.filters.chain import FilterChain
from tiegocancel.filters.config import FilterConfig
from tiegocancel.filters.counters import FilterCounters
from tiegocancel.filters.state import FilterStateBits, filter_state_bits

__all__ = ["FilterChain", "FilterConfig", "FilterCounters", "FilterStateBits", "filter_state_bits"]
