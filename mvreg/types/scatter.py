"""How the poses of one model err together, and what is off in single scans.

Public as part of `mvreg.types`.
"""

from __future__ import annotations

from dataclasses import dataclass

from mvreg.errors import RecordError
from mvreg.geometry.arrays import Array, Indices
from mvreg.types import checks


@dataclass(frozen=True, eq=False)
class PoseScatter:
    """The covariance of all the poses of a model at once, as an adjustment leaves it.

    It is ``U S^-1 (V + M M^T) S^-1 U^T`` for sparse matrices of blocks S and V, of which those with
    ``row <= column`` are listed; both are symmetric. `mvreg.relative_covariance` finds the blocks
    that are asked for.

    Parameters
    ----------
    names : tuple of str
        The scans whose poses were free, in the order of the rows.
    fixed : tuple of str
        Those whose poses were held.
    twists : (6, 6) array
        U for each pose: twists about the model frame's origin, rotation (radians) before
        translation (length), from the unknowns.
    places : (B, 2) array
        Row and column of each block.
    stiffness, scores : (B, 6, 6) arrays
        The blocks of S and V.
    modes : (F, 6, K) array
        M: errors that all poses share.
    """

    names: tuple[str, ...]
    fixed: tuple[str, ...]
    twists: Array
    places: Indices
    stiffness: Array
    scores: Array
    modes: Array

    def __post_init__(self) -> None:
        for name in (*self.names, *self.fixed):
            checks.text("PoseScatter.names", name)
        checks.floats("PoseScatter.twists", self.twists, 6, 6)
        count = len(self.places)
        checks.floats("PoseScatter.stiffness", self.stiffness, count, 6, 6)
        checks.floats("PoseScatter.scores", self.scores, count, 6, 6)
        if self.modes.ndim != 3 or self.modes.shape[:2] != (len(self.names), 6):
            raise RecordError(
                f"PoseScatter.modes: expected shape ({len(self.names)}, 6, K), "
                f"got {self.modes.shape}"
            )


#: What a pattern is, in words, with its size and the deviation of that.
SAID = {
    "scale": "its scale is off by {size:+.1e} (+-{deviation:.1e}) beside that of the others",
    "bend": "it is bent beside the others: points are off by {size:.2g} (+-{deviation:.1g}) "
    "in the root mean square",
}


@dataclass(frozen=True)
class Pattern:
    """A systematic error of a scan, by the pattern of its residuals to the others.

    Parameters
    ----------
    scan : str
    kind : str
        "scale": lengths in the scan are too large by the share `size`; or "bend": root mean square
        of how far points are off along the view, by the square of how far they are off its middle
        (length, positive where the rim is off towards the sensor). Both beside the median of all
        scans: what all share cannot be seen.
    size, deviation : float
        And the standard deviation of that.
    """

    scan: str
    kind: str
    size: float
    deviation: float

    def __post_init__(self) -> None:
        checks.text("Pattern.scan", self.scan)
        if self.kind not in SAID:
            raise RecordError(f"Pattern.kind: expected one of {', '.join(SAID)}, got {self.kind!r}")
        checks.length("Pattern.deviation", self.deviation)

    def __str__(self) -> str:
        return f"{self.scan}: {SAID[self.kind].format(size=self.size, deviation=self.deviation)}"


@dataclass(frozen=True)
class ScanScale:
    """The scale of a scan, as an adjustment has estimated it.

    Parameters
    ----------
    scan : str
    factor : float
        Made larger by it about the middle of its points, the scan lies on the others at its pose.
    deviation : float
        The standard deviation of that.
    """

    scan: str
    factor: float
    deviation: float

    def __post_init__(self) -> None:
        checks.text("ScanScale.scan", self.scan)
        checks.length("ScanScale.factor", self.factor)
        checks.length("ScanScale.deviation", self.deviation)

    @property
    def off(self) -> bool:
        """Whether it is other than one by more than chance: by five standard deviations."""
        return abs(self.factor - 1) > 5 * self.deviation

    def __str__(self) -> str:
        return (
            f"{self.scan}: its points are to be taken times 1{self.factor - 1:+.1e} "
            f"(+-{self.deviation:.1e}) beside those of the others"
        )
