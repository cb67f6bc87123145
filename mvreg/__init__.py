"""Fully automatic registration of unordered range scans.

    import mvreg

    scans = mvreg.dataset("folder", path="my_scans")
    result = mvreg.register(scans)
    print(result.poses, result.unregistered)

Names are looked up when they are first used, so that importing mvreg stays cheap.
"""

from typing import TYPE_CHECKING

from mvreg._lazy import looked_up

if TYPE_CHECKING:
    from mvreg._open3d import load_open3d as load_open3d
    from mvreg._version import __version__ as __version__
    from mvreg.errors import InputError as InputError
    from mvreg.errors import MvregError as MvregError
    from mvreg.errors import PluginError as PluginError
    from mvreg.evaluation.assess import assess as assess
    from mvreg.evaluation.pose_errors import PoseErrors as PoseErrors
    from mvreg.evaluation.pose_errors import pose_errors as pose_errors
    from mvreg.evaluation.relative import relative_covariance as relative_covariance
    from mvreg.export.library import write as write
    from mvreg.library import dataset as dataset
    from mvreg.library import prepare as prepare
    from mvreg.library import register as register
    from mvreg.pipeline import Pipeline as Pipeline
    from mvreg.plugins.hookspecs import hookimpl as hookimpl
    from mvreg.progress import CancelledError as CancelledError
    from mvreg.progress import Progress as Progress
    from mvreg.report.comparison.frame import compare as compare
    from mvreg.report.page.inline import show as show
    from mvreg.run import Method as Method
    from mvreg.run import load_method as load_method
    from mvreg.types import Result as Result
    from mvreg.types import Scan as Scan
    from mvreg.types import ScanSet as ScanSet

_WHERE = {
    "CancelledError": "progress",
    "InputError": "errors",
    "Method": "run",
    "MvregError": "errors",
    "Pipeline": "pipeline",
    "PluginError": "errors",
    "PoseErrors": "evaluation.pose_errors",
    "Progress": "progress",
    "Result": "types",
    "Scan": "types",
    "ScanSet": "types",
    "__version__": "_version",
    "assess": "evaluation.assess",
    "compare": "report.comparison.frame",
    "dataset": "library",
    "hookimpl": "plugins.hookspecs",
    "load_method": "run",
    "load_open3d": "_open3d",
    "pose_errors": "evaluation.pose_errors",
    "prepare": "library",
    "register": "library",
    "relative_covariance": "evaluation.relative",
    "show": "report.page.inline",
    "write": "export.library",
}

__all__ = sorted(_WHERE)
__getattr__, __dir__ = looked_up(__name__, _WHERE)
