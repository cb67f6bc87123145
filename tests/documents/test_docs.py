"""What the documents say is true: their commands and code run, their tables are the program's."""

import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from blocks import blocks_of, commands_of
from fake_plugins import install
from include import DOCUMENTS, included
from observed import run as observed_run

import mvreg
from mvreg.cli import main as cli
from mvreg.config.compose import compose
from mvreg.config.presets import choices
from mvreg.io import write_ply
from mvreg.plugins import manager
from mvreg.report.json_file import dumps
from mvreg.testing import SeedContract

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
SCANS, RUNS, METHODS = (
    (ROOT / "docs" / f"{name}.md").read_text() for name in ("scans", "runs", "methods")
)
STANFORD = {"bunny", "dragon", "buddha", "armadillo"}


def blocks(text: str, language: str) -> list[str]:
    """The blocks of code in one language."""
    return [block.text for block in blocks_of(text) if block.language == language]


def commands(text: str) -> list[str]:
    """The lines of the shell blocks that can be run here, without their comments."""
    found = [each for block in blocks_of(text) if block.language == "sh"
             and block.special != "not run" for each, _ in commands_of(block)]  # fmt: skip
    return list(dict.fromkeys(" ".join(command.split()) for command in found))


def words_after(heading: str, table_of: str) -> list[str]:
    """The words in code type in the first column of the table below a heading."""
    table = table_of.partition(f"## {heading}\n")[2].partition("\n## ")[0]
    cells = "".join(re.findall(r"^\|([^|]*)\|", table, re.MULTILINE))
    return re.findall(r"`([^`]*)`", cells)


STAGE = next(block for block in blocks(README, "python") if "mvreg_stages" in block)
LIBRARY = next(block for block in blocks(README, "python") if "mvreg.register" in block)
#: Of the pages below docs/, `test_pages.py` runs the commands, each page's in turn.
ELSEWHERE = [file for file in DOCUMENTS if ROOT / "docs" not in file.parents]
COMMANDS = [
    command for file in ELSEWHERE for command in commands(file.read_text())
    if command.startswith("mvreg")
]  # fmt: skip


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder like a reader's: with scans of their own, an earlier run, the README's plugin."""
    folder = tmp_path_factory.mktemp("desk")
    for part in ("my_scans", "packages", "runs/plates/grow/earlier"):
        (folder / part).mkdir(parents=True)
    for scan in mvreg.dataset("figurine", views=4).scans:
        write_ply(folder / "my_scans" / f"{scan.name}.ply", scan.points)
    install(folder / "packages", "mutual", STAGE)
    report = observed_run()[-1].report
    (folder / "runs/plates/grow/earlier/result.json").write_text(dumps(report))
    return folder


def run(words: list[str], desk: Path) -> subprocess.CompletedProcess[str]:
    """Run a command at the desk."""
    path = os.pathsep.join(filter(None, [str(desk / "packages"), os.environ.get("PYTHONPATH")]))
    return subprocess.run(
        words, cwd=desk, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True,
        timeout=600, check=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def demo(desk: Path) -> tuple[list[str], Path]:
    """What ``make demo`` prints, as lines, and the run folder."""
    if shutil.which("make") is None:
        pytest.skip("needs make")
    dry = subprocess.run(
        ["make", "--dry-run", "demo"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    (arguments,) = re.findall(r" -m mvreg (.*)", dry.stdout)
    assert arguments == "dataset=figurine"
    done = run([sys.executable, "-m", "mvreg", *arguments.split()], desk)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines(), desk / "runs/figurine/auto/latest"


def cells(line: str) -> list[str]:
    """The columns of a line of the table."""
    return re.split(r"\s{2,}", line.strip())


def numbers(line: str) -> list[float]:
    """The decimal numbers of a line."""
    return [float(number) for number in re.findall(r"\d+\.\d+", line)]


def test_the_demo_prints_what_the_readme_shows_and_leaves_the_files_it_lists(demo):
    printed, folder = demo
    (shown,) = (block.splitlines() for block in blocks(README, "text"))
    (head, ours), (head_shown, theirs) = (
        ([cells(line) for line in lines if line.lstrip().startswith("scan ")],
         [cells(line)[:3] for line in lines if line.lstrip().startswith("figurine_")])
        for lines in (printed, shown)
    )  # fmt: skip
    assert head == head_shown and len(head) == 1
    assert ours == theirs and len(ours) == 12
    for start in ("placed ", "e_R ", "consistency: ", "written to ", "see it with: "):
        (line,), (line_shown,) = (
            [line for line in lines if line.startswith(start)] for lines in (printed, shown)
        )
        words = r"\d+\.\d+|with \d+ pairs|[\d_-]{20,}"
        assert re.sub(words, "#", line) == re.sub(words, "#", line_shown)
        if start in ("e_R ", "consistency: "):
            close = pytest.approx(numbers(line), rel=0.25, abs=0.01)
            assert numbers(line_shown) == close, "copy what `make demo` prints into the README"
    left = {f"{file.name}/" if file.is_dir() else file.name for file in folder.iterdir()}
    assert left == set(words_after("What a run leaves behind", RUNS))


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_runs(command, desk, request):
    words = shlex.split(command)
    if any(word.removeprefix("dataset=") in STANFORD for word in words):
        request.getfixturevalue("data_root")
    done = run([sys.executable, "-m", *words], desk)
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    assert done.stdout


def test_every_command_is_one_that_the_tests_know():
    for file in ELSEWHERE:
        for command in commands(file.read_text()):
            first, *rest = command.split()
            assert first == "mvreg" or (first, *rest) in {
                ("make", "demo"), ("make", "test"), ("pip", "install", "-e", "."),
            }  # fmt: skip


def test_the_make_targets_of_the_readme_exist():
    if shutil.which("make") is None:
        pytest.skip("needs make")
    asked = [command for command in commands(README) if command.startswith("make ")]
    assert asked
    for command in asked:
        subprocess.run([*command.split(), "--dry-run"], cwd=ROOT, check=True, timeout=60,
                       stdout=subprocess.DEVNULL)  # fmt: skip


def test_the_library_example_runs(capsys):
    assert len(LIBRARY.splitlines()) <= 6
    names: dict[str, object] = {}
    exec(compile(LIBRARY, "README.md", "exec"), names)
    result = names["result"]
    assert isinstance(result, mvreg.Result)
    assert len(result.poses) == 12
    shown = capsys.readouterr().out
    assert "figurine_11" in shown and "not placed: ()" in shown


def mutual() -> type:
    """The stage of the README."""
    names: dict[str, object] = {"__name__": "mutual"}
    exec(compile(STAGE, "README.md", "exec"), names)
    stages = names["mvreg_stages"]()  # type: ignore[operator]
    return stages["seed/mutual"]


class Mutual(mutual()):  # type: ignore[misc]
    """The stage of the README where pickle finds it."""


class TestTheStageOfTheReadme(SeedContract):
    stage = Mutual()


def test_the_stage_has_20_lines_and_a_project_that_names_its_module():
    stage = STAGE.partition("@dataclass")[2]
    assert len([line for line in stage.splitlines() if line]) <= 20
    (project,) = (tomllib.loads(block) for block in blocks(README, "toml"))
    assert project["project"]["entry-points"]["mvreg"] == {"mutual": "mutual"}
    assert "`mutual.py`" in README


def test_the_exit_codes_are_the_program_s():
    table = RUNS.partition("| code |")[2].partition("\n\n")[0]
    assert [int(code) for code in re.findall(r"^\| (\d+) \|", table, re.MULTILINE)] == [
        cli.DONE, cli.NOT_PLACED, cli.WRONG_INPUT, cli.BUG, cli.INTERRUPTED,
    ]  # fmt: skip


def test_the_data_sets_are_the_program_s():
    named = set(words_after("Data sets", SCANS)) - {"dataset="}
    assert named == set(choices()["dataset"]) - {"stanford"}
    text = SCANS.partition("## Where data sets are looked for\n")[2]
    for name in STANFORD:
        assert f"`{compose([f'dataset={name}']).dataset.folders[0]}`" in text


@pytest.mark.parametrize("file", DOCUMENTS, ids=lambda file: str(file.relative_to(ROOT)))
def test_links_lead_somewhere(file):
    links = re.findall(r"\]\(([^)\s]+)\)", file.read_text())
    local = [link.partition("#")[0] for link in links if not link.startswith(("http:", "https:"))]
    assert [link for link in local if link and not (file.parent / link).exists()] == []


@pytest.mark.parametrize("file", DOCUMENTS, ids=lambda file: str(file.relative_to(ROOT)))
def test_included_code_is_the_code_that_runs(file):
    assert included(file) == file.read_text(), "run `make include`"


def test_the_tutorial_is_included():
    tutorial = ROOT / "plugins/mvreg-fpfh"
    assert (tutorial / "mvreg_fpfh.py").read_text() in (tutorial / "README.md").read_text()


def test_the_pictures_are_small():
    pictures = re.findall(r"!\[[^]]*\]\(([^)]*)\)", README)
    assert pictures
    for picture in pictures:
        assert 50_000 < (ROOT / picture).stat().st_size < 600_000


def test_the_methods_and_stages_are_the_program_s():
    offered = choices()
    assert set(words_after("Methods", METHODS)) == {*offered["method"], "+method="}
    kinds = {"refine", "judge", "strategy", "adjust"}
    assert set(words_after("Stages", METHODS)) == kinds
    table = METHODS.partition("## Stages\n")[2].partition("\n## ")[0]
    for kind in kinds:
        (row,) = re.findall(rf"^\| `{kind}` \|(.*)\|$", table, re.MULTILINE)
        core = {s.name for s in manager.stages().values() if s.kind == kind and s.plugin == "mvreg"}
        assert set(re.findall(r"`([^`]*)`", row)) == core


def test_the_changelog_knows_this_version():
    release = mvreg.__version__.partition(".dev")[0]
    assert f"## [{release}]" in (ROOT / "CHANGELOG.md").read_text()


def test_the_painter_shows_what_is_in_front(monkeypatch):
    from experiments.report import picture

    up = np.tile([0.0, 0, 1], (3, 1))
    points = np.array([[0.0, 0, 1], [0, 0, 2], [3, 0, 0]])  # red, before it blue, green aside
    away = np.array([[0.0, 0, 3]])  # nearest of all, but seen from behind
    cloud = picture.Cloud(
        np.concatenate([points, away]), np.concatenate([up, -up[:1]]),
        np.array([[1.0, 0, 0], [0, 0, 1], [0, 1, 0], [1, 1, 1]]),
    )  # fmt: skip
    image = picture.render(cloud, 10, 8, 2)
    assert image.shape == (16, 20, 3)
    assert image[8, 10].argmax() == 2 and image[8, 10, 0] < 0.1
    assert image[8, 16].argmax() == 1
    assert (image[0] == 1).all()
