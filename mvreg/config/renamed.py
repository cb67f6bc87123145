"""Parameters of stages that have been renamed: what they are called now.

The command line and reports of earlier runs may use the names that they had.
"""

from __future__ import annotations

#: ``kind.parameter`` as it was, and as it is.
PARAMETERS = {
    "judge.max_rival": "judge.max_alternative",
    "judge.rival_angle": "judge.alternative_angle",
    "judge.rival_distance": "judge.alternative_distance",
    "judge.min_stability": "judge.min_localizability",
    "strategy.give_up": "strategy.early_rejection",
    "strategy.patience": "strategy.max_failures",
}


def renamed_parameter(key: str) -> str | None:
    """What a parameter is called now, None where it has not been renamed."""
    return PARAMETERS.get(key)
