from mvreg.stages.adjust.none import NoAdjust
from mvreg.testing import blob_views, pipeline
from mvreg.testing.adjust import nearly_right


def test_none_leaves_the_result_alone():
    result = nearly_right()
    assert NoAdjust()(result, blob_views(3), pipeline()) is result
