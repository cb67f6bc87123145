"""What ``mvreg new-plugin`` begins with keeps its contracts."""

from importlib import import_module

from mvreg.contracts import KINDS
from mvreg.kit.templates.exporter import NAMELESS
from mvreg.testing import SUITES, ExportContract

STAGES = {
    kind: getattr(import_module(f"mvreg.kit.templates.{kind}"), f"Nameless{kind.title()}")
    for kind in KINDS
}

for _kind, _cls in STAGES.items():
    _name = f"Test{_cls.__name__}"
    globals()[_name] = type(_name, (SUITES[_kind],), {"stage": _cls()})


class TestNamelessExporter(ExportContract):
    format = NAMELESS


def test_there_is_one_of_every_kind():
    assert set(STAGES) == set(SUITES)
