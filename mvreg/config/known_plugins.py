"""Methods that are known by name and come with a distribution of their own.

Where it is not installed, a stand-in takes the preset's place. So a sweep over several methods
runs those that are there, and the others' jobs fail one by one, saying what to install.
"""

from __future__ import annotations

from collections.abc import Collection

from omegaconf import DictConfig

from mvreg.errors import InputError

#: What brings each method.
DISTRIBUTIONS = {
    "surfc": "mvreg-comparators",
    "spant": "mvreg-comparators",
    "open3d_multiway": "mvreg-peers",
    "kiss_gicp": "mvreg-peers",
}

#: What brings the stages and methods that are known by name and are not in the core.
BROUGHT_BY = {
    "strategy/surfc": "mvreg-comparators",
    "strategy/spant": "mvreg-comparators",
    "judge/visibility": "mvreg-comparators",
    "judge/dual": "mvreg-comparators",
    "strategy/open3d_multiway": "mvreg-peers",
    "strategy/kiss_gicp": "mvreg-peers",
    "describe/fpfh": "mvreg-fpfh",
    **{f"method/{name}": package for name, package in DISTRIBUTIONS.items()},
}


def to_install(choice: str, package: str) -> str:
    """The message for a `choice`, such as ``+method=surfc``, that `package` would bring."""
    return (
        f"{choice} comes with the plugin {package}, which is not installed; install it "
        f"with: pip install ./plugins/{package}"
    )


def stand_ins(installed: Collection[str]) -> dict[str, dict[str, object]]:
    """A preset for each method that is not installed; without a strategy, so that it cannot run.

    Parameters
    ----------
    installed : collection of str
        The methods that have a preset.
    """
    absent = [name for name in DISTRIBUTIONS if name not in installed]
    return {name: {"method": name, "strategy": None} for name in absent}


def refuse_stand_in(config: DictConfig) -> None:
    """Say what brings the method of a configuration, if all there is of it is a stand-in.

    Raises
    ------
    InputError
        Names the distribution to install.
    """
    name = config.method
    if name in DISTRIBUTIONS and config.strategy is None:
        raise InputError(to_install(f"+method={name}", DISTRIBUTIONS[name]))
