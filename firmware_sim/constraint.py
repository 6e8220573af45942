"""State one constraint of a budget: what is needed, what the part has, and the verdict."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

__all__ = ["Constraint", "Evidence", "binding"]

Evidence = Literal["exact", "simulated", "estimated", "datasheet"]
"""How a need is known: counted; by the cycle simulator; by a model with a stated error; from a document."""

_TIGHT = 0.2
_NOTHING_LEFT = -1e9


@dataclass(frozen=True, slots=True, kw_only=True)
class Constraint:
    """Compare a need with what there is, in one unit; ``have`` is what may be used, not all there is.

    ``kind``: ``fit`` for what does not depend on the events (memory, logic, clock), ``pace`` for what does.
    ``error_share``: of the need, where it is estimated. ``note``: what the numbers rest on.
    """

    name: str
    kind: Literal["fit", "pace"]
    need: float
    have: float
    unit: str
    evidence: Evidence
    error_share: float = 0.0
    note: str = ""

    @property
    def margin(self) -> float:
        """Share of what there is that is left; negative where it is not enough; limited to −10⁹ where there is none."""
        if self.need <= 0:
            return 1.0
        if self.have <= 0 or not math.isfinite(self.need):
            return _NOTHING_LEFT
        return max(1.0 - self.need / self.have, _NOTHING_LEFT)

    @property
    def ok(self) -> bool:
        """Tell whether there is enough."""
        return self.need <= self.have

    @property
    def verdict(self) -> str:
        """Say ``pass``, ``tight`` (less than a fifth left, or less than the estimate may err), or ``FAIL``."""
        if not self.ok:
            return "FAIL"
        return "tight" if self.need > 0 and self.margin < max(_TIGHT, self.error_share) else "pass"


def binding(constraints: list[Constraint]) -> Constraint:
    """Return the constraint with the least margin."""
    return min(constraints, key=lambda one: one.margin)
