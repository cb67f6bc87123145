"""The documentation's figures are drawn from runs."""

import pytest

from experiments.site.draw import FIGURES, PICTURES, main
from mvreg.errors import InputError


def test_every_figure_is_there_and_no_other_name_is_known(tmp_path):
    assert [name for name in FIGURES if not (PICTURES / f"{name}.png").is_file()] == []
    with pytest.raises(InputError, match="no figure nothing; there are: places, heap"):
        main(["nothing"], tmp_path)


@pytest.mark.slow
def test_the_search_is_drawn_again(tmp_path):
    pytest.importorskip("matplotlib")
    main(["search"], tmp_path)
    size = (tmp_path / "search.png").stat().st_size
    assert size == pytest.approx((PICTURES / "search.png").stat().st_size, rel=0.2)
