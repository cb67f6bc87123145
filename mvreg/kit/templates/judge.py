"""Whether a registration can be relied on: ``judge=nameless``."""

from __future__ import annotations

from dataclasses import dataclass

from mvreg.errors import check_positive
from mvreg.surface import surface_fit
from mvreg.types import Registration, Verdict, View, ViewGraph


@dataclass(frozen=True)
class NamelessJudge:
    """Reliable if paired points lie in each other's planes, their normals agree, and they are many.

    Parameters
    ----------
    max_residual : float
        Root mean square distance of the source's points to the target's planes, in units of the
        resolution of the down-sampled scans.
    min_agreement : float
        Mean cosine between paired normals.
    min_overlap : float
        Share of the source's points that are in pairs.
    """

    max_residual: float = 0.5
    min_agreement: float = 0.85
    min_overlap: float = 0.4

    def __post_init__(self) -> None:
        check_positive("judge", max_residual=self.max_residual)

    def __call__(
        self, registration: Registration, source: View, target: View, graph: ViewGraph
    ) -> Verdict:
        """Judge a registration of `source` to `target`; the `graph` is not asked.

        Returns
        -------
        Verdict
            With the residual as its score.
        """
        residual, agreement = surface_fit(registration, source, target)
        reason = "residual small and normals agree"
        if residual > self.max_residual:
            reason = "residual too large"
        elif agreement < self.min_agreement:
            reason = "normals disagree"
        elif registration.overlap < self.min_overlap:
            reason = "overlap too small"
        else:
            return Verdict(True, residual, self.max_residual, reason)
        return Verdict(False, residual, self.max_residual, reason)
