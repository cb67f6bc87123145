"""The contract of every stage."""

from __future__ import annotations

import contextlib
import io
import pickle
import warnings
from dataclasses import fields, is_dataclass, replace
from typing import Any, ClassVar

import numpy as np
from omegaconf import OmegaConf

from mvreg.contracts import KINDS
from mvreg.plugins.registry import check
from mvreg.stage_calls import checked
from mvreg.testing.compare import case, digest
from mvreg.testing.silence import captured
from mvreg.testing.words import equal, expect


class StageContract:
    """Base of the suites. A subclass in a test file gives the `stage`, and pytest does the rest.

        class TestMySeed(SeedContract):
            stage = MySeed()

    `kind` is the suite's. Suites state tolerances and what may be waived as class attributes; a
    subclass that changes one should say why.
    """

    stage: Any
    kind: ClassVar[str]
    #: Whether the kind's stages are given a random generator as their last argument.
    draws: ClassVar[bool] = False

    def call(self, *arguments: Any, stage: Any = None) -> Any:
        """Run the stage, and check what holds at every call.

        The input stays as it was to the last bit, nothing is printed, and no calculation warns (as
        a division by zero does). A random generator is added if the kind asks for one.
        """
        before = digest(arguments)
        output = io.StringIO()
        drawing = (np.random.default_rng(0),) if self.draws else ()
        with (
            warnings.catch_warnings(),
            contextlib.redirect_stdout(output),
            contextlib.redirect_stderr(output),
        ):
            warnings.simplefilter("error", RuntimeWarning)
            answer = (self.stage if stage is None else stage)(*arguments, *drawing)
        expect(
            digest(arguments) == before, "the stage to leave its input as it is", "a changed one"
        )
        expect(output.getvalue() == "", "a silent stage", f"it printed {output.getvalue()!r}")
        return answer

    def examples(self) -> dict[str, tuple[Any, ...]]:
        """Ordinary arguments, by what they are; for the suite of a kind to define."""
        raise NotImplementedError

    def degenerate(self) -> dict[str, tuple[Any, ...]]:
        """Arguments that nothing can be made of, by what is wrong with them; for the suite."""
        return {}

    def verify(self, arguments: tuple[Any, ...], answer: Any) -> None:
        """Check shapes, types and ranges of an answer; for the suite of a kind to define."""
        raise NotImplementedError

    def essence(self, answer: Any) -> str:
        """What must be the same to the last bit, as a text; a suite may leave out times."""
        return digest(answer)

    def test_it_can_be_registered(self) -> None:
        check(f"{self.kind}/this", type(self.stage), "the suite")
        expect(self.kind in KINDS, f"a kind among {list(KINDS)}", self.kind)
        doc = type(self.stage).__doc__ or ""
        expect(
            doc.strip() and not doc.startswith(f"{type(self.stage).__name__}("),
            "a docstring, whose first line `mvreg plugins` shows", "none",
        )  # fmt: skip

    def test_its_fields_are_all_there_is_to_it(self) -> None:
        expect(
            is_dataclass(self.stage) and not isinstance(self.stage, type),
            "an instance of a dataclass",
            self.stage,
        )
        again = replace(self.stage)
        equal("dataclasses.replace() to give an equal stage", again, self.stage)
        equal("the same repr() for equal stages", repr(again), repr(self.stage))
        expect(
            " at 0x" not in repr(self.stage), "a repr() that tells the parameters", repr(self.stage)
        )
        self.call(*next(iter(self.examples().values())))
        names = {field.name for field in fields(self.stage)}
        extra = sorted(set(getattr(self.stage, "__dict__", {})) - names)
        expect(not extra, "a stage that remembers nothing but its parameters", f"also {extra}")

    def test_it_survives_pickling(self) -> None:
        copy = pickle.loads(pickle.dumps(self.stage))
        equal("an equal stage after pickling", copy, self.stage)
        arguments = next(iter(self.examples().values()))
        first, second = self.call(*arguments), self.call(*arguments, stage=copy)
        alike = self.essence(first) == self.essence(second)
        expect(alike, "the same answer of the stage after pickling", "another")

    def test_it_survives_a_configuration(self) -> None:
        text = OmegaConf.to_yaml(OmegaConf.structured(self.stage))
        node = OmegaConf.structured(type(self.stage))
        OmegaConf.set_readonly(node, None)  # as the store does: frozen means read-only
        found = OmegaConf.to_object(OmegaConf.merge(node, OmegaConf.create(text)))
        expect(
            type(found) is type(self.stage),
            "the stage's class back from a configuration",
            type(found).__name__,
        )
        equal("an equal stage back from a configuration in YAML", found, self.stage)

    def test_it_answers_in_the_right_form(self) -> None:
        for name, arguments in self.examples().items():
            with case(name):
                self.verify(arguments, self.call(*arguments))

    def test_the_same_input_gives_the_same_answer(self) -> None:
        for name, arguments in self.examples().items():
            with case(name):
                first, second = self.call(*arguments), self.call(*arguments)
                alike = self.essence(first) == self.essence(second)
                expect(alike, "the same answer to the last bit for the same input", "another")

    def test_it_says_nothing(self) -> None:
        """Also where compiled code writes."""
        arguments = next(iter(self.examples().values()))
        with captured() as written:
            self.call(*arguments)
        expect(not written, "nothing on standard output and error", "".join(written))

    def test_a_run_takes_its_answers(self) -> None:
        """What `mvreg.register` checks at every call, a plugin's author can see beforehand."""
        stage = checked(self.kind, self.stage)
        for name, arguments in {**self.examples(), **self.degenerate()}.items():
            with case(name):
                self.call(*arguments, stage=stage)

    def test_it_takes_the_worst_calmly(self) -> None:
        for name, arguments in self.degenerate().items():
            with case(name):
                self.verify(arguments, self.call(*arguments))
