"""Stages called with their answers checked: a stage that is wrong is named, at its first wrong act.

Records check themselves, see `mvreg.types`; here is what needs both sides of a call, and the
message: which stage of which distribution, what its contract wants, and what came.
"""

from mvreg.stage_calls.calls import check_described, checked

__all__ = ["check_described", "checked"]
