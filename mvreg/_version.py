"""The version of mvreg that is installed."""

from importlib.metadata import version

__version__ = version("mvreg")
