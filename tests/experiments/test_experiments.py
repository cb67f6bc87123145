"""The experiments compose, and their report says what the runs say."""

import json
import re
from pathlib import Path

import pytest
from observed import run as observed_run

from mvreg.config import compose
from mvreg.config.presets import choices
from mvreg.contracts import KINDS
from mvreg.errors import InputError
from mvreg.report.json_file import dumps

ROOT = Path(__file__).parents[2]
NAMES = sorted(file.stem for file in (ROOT / "conf/experiment").glob("*.yaml"))

#: Scenes in code, which some builds have and others do not: all of them or none.
EMBEDDED = {"room", "office", "street", "yard", "desk"}


def fabricate(errors=(0.01, 1.0), placed=2, angle=1.0, **changes):
    """A report of a made-up run: three scans, of which some are placed."""
    report = json.loads(dumps(observed_run()[-1].report))
    names = ["a", "b", "c"]
    scans = {name: {"angle_deg": angle if name == "b" else 0.0} for name in names[:placed]}
    mean = {"rotation": errors[0], "angle_deg": 0.1, "translation": errors[1]}
    report.update(
        poses=dict.fromkeys(names[:placed], 0), unregistered=names[placed:],
        errors={"frame": "a", "mean": mean, "max": mean, "scans": scans},
        status="complete" if placed == 3 else "incomplete", commit="0123456789ab",
        machine={"cpu": "Abacus 3", "cores": 2, "threads": 1, "system": "Linux"},
        finished="2001-02-03T04:05:06+00:00",
    )  # fmt: skip
    report["seconds"]["total"] = changes.pop("seconds", 10.0)
    return {**report, **changes}


def leave(root, experiment, overrides, report=None, error=None):
    """A job's folder, as a sweep leaves it."""
    from experiments.common import runs

    folder = root / experiment / runs.dirname(overrides)
    (folder / ".hydra").mkdir(parents=True)
    (folder / ".hydra/overrides.yaml").write_text(
        "".join(f"- {each}\n" for each in [*overrides, f"+experiment={experiment}"])
    )
    if report is not None:
        (folder / "result.json").write_text(dumps(report))
    if error is not None:
        (folder / "error.txt").write_text(error)
    return folder


def page(root, out, name="table1"):
    from experiments.report import build

    build.main(root, out, figures=False)
    return (out / f"{name}.md").read_text()


def rows(text):
    """The cells of each row of a page's table, by its first two."""
    lines = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]
    return {tuple(cells[:2]): cells for cells in lines}


def test_there_are_the_tables_and_the_ablations():
    assert set(NAMES) == {
        "table1", "table2", "table3", "peers", "delta", "scales", "tmse", "overlap", "noise",
        "sampling", "orders", "mixtures_pairs", "mixtures_drawn", "mixtures_foreign", "subsets",
        "spoilt_noise", "spoilt_outliers", "spoilt_density", "spoilt_all", "shapes",
        "folders", "environments", "virtual",
    }  # fmt: skip
    assert choices()["experiment"] == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_every_job_composes_to_what_it_says(name):
    from experiments.common import runs

    jobs = runs.plan(name)
    assert len(set(jobs)) == len(jobs) >= 5
    values = {key: list(dict.fromkeys(v)) for key, v in zip(*transposed(jobs), strict=True)}
    if not EMBEDDED & set(choices()["dataset"]):
        values["dataset"] = [each for each in values["dataset"] if each not in EMBEDDED]
    base = {key: each[0] for key, each in values.items()}
    for key, each in values.items():  # one at a time: all of them would take a minute
        for value in each if len(each) < 10 else (each[0], each[-1]):
            check_job(name, {**base, key: value})


@pytest.mark.parametrize("name", NAMES)
def test_every_experiment_composes_before_its_jobs_are_known(name):
    """Hydra does so at the start of a sweep, with the default method."""
    assert compose.compose([f"+experiment={name}"]).method == "auto"


def transposed(jobs):
    pairs = [[word.split("=", 1) for word in job] for job in jobs]
    keys = [key for key, _ in pairs[0]]
    return keys, [[job[i][1] for job in pairs] for i in range(len(keys))]


def check_job(name, values):
    words = [f"{key}={value}" for key, value in values.items()]
    try:
        composed = compose.compose([*words, f"+experiment={name}"])
    except InputError as error:
        assert "not installed" in str(error)
        return
    assert (composed.rerun, composed.resume) == (False, True)
    stages = compose.stages_from(composed)
    assert set(stages) == set(KINDS) - {"dataset"}
    for key, value in values.items():
        if "." in key:
            kind, _, parameter = key.partition(".")
            found = re.sub(r"[' ]", "", str(composed[kind][parameter]))
            assert found in (value, f"{value}.0")
    assert composed.method == values["+method"]


def test_the_orders_are_others_than_the_files():
    for name in ("table3", "peers", "orders"):
        composed = compose.compose([f"+experiment={name}", "dataset=bunny", "+method=fcpma"])
        assert composed.dataset.order.value == "shuffle"
        assert composed.dataset.scramble == (name != "table3")


@pytest.mark.parametrize("name", ["bunny", "dragon", "buddha", "armadillo_virtual"])
def test_folders_are_bare_points_in_any_order_and_place(name):
    composed = compose.compose(["+experiment=folders", f"dataset={name}"]).dataset
    assert (composed.order.value, composed.scramble, composed.sensor) == (
        "shuffle",
        True,
        "unknown",
    )


@pytest.mark.parametrize("name", ["rgbd_desk", "lidar_campus", "tls_office"])
def test_recorded_environments_are_moved_and_keep_what_is_known_of_them(name):
    plain = compose.compose([f"dataset={name}"]).dataset
    composed = compose.compose(["+experiment=environments", f"dataset={name}"]).dataset
    assert composed == {**plain, "scramble": True} and not plain.scramble


def test_a_folder_is_what_hydra_calls_it(tmp_path, monkeypatch):
    from hydra import compose, initialize_config_module

    from experiments.common import runs
    from mvreg.config.store import registered

    job = runs.plan("delta")[0]
    with registered(), initialize_config_module("mvreg.conf", version_base="1.3"):
        composed = compose("config", [*job, "+experiment=delta"], return_hydra_config=True)
    assert composed.hydra.job.override_dirname == runs.dirname(job)
    assert composed.hydra.sweep.dir == "runs/experiments/delta"
    assert runs.ROOT == ROOT / "runs/experiments"


def test_jobs_are_read_back_whatever_became_of_them(tmp_path):
    from experiments.common import runs

    jobs = runs.plan("table1")
    leave(tmp_path, "table1", jobs[0], fabricate())
    leave(tmp_path, "table1", jobs[1], fabricate(), error="no scans\nhere")
    leave(tmp_path, "table1", jobs[2])
    leave(tmp_path, "table1", jobs[3], fabricate(status="interrupted"))
    leave(tmp_path, "table1", [*jobs[4], "dataset.order=shuffle"], fabricate())
    (tmp_path / "table1/latest").symlink_to(runs.dirname(jobs[0]))
    found = runs.runs("table1", tmp_path)
    assert [run.overrides for run in found[: len(jobs)]] == jobs
    assert found[0].report["num_pairs"] == 3 and found[0].error is None
    assert [run.error for run in found[1:5]] == [
        "no scans\nhere", "cut short", "interrupted", "not run",
    ]  # fmt: skip
    assert all(run.report is None for run in found[1:5])
    (other,) = found[len(jobs) :]
    assert other.value("dataset.order") == "shuffle" and other.report is not None
    assert (found[0].value("method"), found[0].value("rng", "0")) == ("ocpra", "0")


def test_the_folder_of_a_mixture_is_what_hydra_calls_it_too():
    from hydra import compose, initialize_config_module

    from experiments.common import runs
    from mvreg.config.store import registered

    job = ["+method=fcpma", *runs.plan("mixtures_foreign")[0][1:]]
    assert "dataset.of=[bunny,dragon]" in job and "dataset.keep=[all,1]" in job
    with registered(), initialize_config_module("mvreg.conf", version_base="1.3"):
        words = [*job, "+experiment=mixtures_foreign"]
        composed = compose("config", words, return_hydra_config=True)
    assert composed.hydra.job.override_dirname == runs.dirname(job)


def test_an_unknown_experiment_is_told_what_there_is(tmp_path):
    from experiments.common import runs

    with pytest.raises(InputError, match="delta, environments, folders, mixtures_drawn"):
        runs.runs("table9", tmp_path)


def test_a_table_has_ours_beside_the_printed(tmp_path):
    leave(tmp_path, "table1", ["+method=fcpma", "dataset=bunny"], fabricate(
        (0.0130, 0.723), placed=3, num_pairs=2, seconds=4.0, model_points=100))  # fmt: skip
    leave(tmp_path, "table1", ["+method=ocpma", "dataset=bunny"], fabricate(
        (0.0087, 0.4877), placed=3, num_pairs=2, seconds=6.0, model_points=110))  # fmt: skip
    leave(tmp_path, "table1", ["+method=ocpra", "dataset=bunny"], fabricate(
        (0.0065, 0.3356), placed=2, num_pairs=9, seconds=9, model_points=90, angle=7))  # fmt: skip
    text = page(tmp_path, tmp_path / "out")
    found = rows(text)
    head = found["data set", "method"]
    fcpma = dict(zip(head, found["bunny", "fcpma"], strict=True))
    assert found["bunny", "fcpma"][2:12] == [
        "3 of 3", "0", "2", "0.0130", "0.0065", "2.00", "0.723", "0.3615", "2.00", "4.0",
    ]  # fmt: skip
    assert (fcpma["time ratio"], fcpma["model points"]) == ("1.00", "100")
    assert found["bunny", "ocpma"][head.index("time ratio")] == "1.50"
    assert found["bunny", "ocpra"][2:6] == ["2 of 3", "1", "9", "0.0065\\*"]
    assert found["buddha", "fcpma"][2] == "*not run*"
    # The order is the paper's: data sets, and in them methods.
    assert [key for key in found if key[0] == "bunny"] == [
        ("bunny", "ocpra"), ("bunny", "ocpma"), ("bunny", "fcpma"),
    ]  # fmt: skip


def verdicts(text):
    """The verdict and the numbers of each claim, by its beginning."""
    found = re.findall(r"^- \*\*([a-z ]+)\*\*: (.*)$", text, re.MULTILINE)
    return {claim[:28]: (verdict, claim) for verdict, claim in found}


def test_pages_that_are_not_asked_for_stay_as_they_are(tmp_path):
    from experiments.report import build

    out = tmp_path / "out"
    page(tmp_path, out)
    contents, other = (out / "README.md").read_text(), (out / "table2.md").read_text()
    for name in ("table1", "table2"):
        leave(tmp_path, name, ["+method=fcpma", "dataset=bunny"], fabricate(placed=3))
    build.main(tmp_path, out, figures=False, only=["table1"])
    assert (out / "table2.md").read_text() == other
    assert rows((out / "table1.md").read_text())["bunny", "fcpma"][2] == "3 of 3"
    assert (out / "README.md").read_text() == contents.replace("md) | 0 of 12", "md) | 1 of 12", 1)
    with pytest.raises(InputError, match="no page table9; there are: table1, table2"):
        build.main(tmp_path, out, figures=False, only=["table9"])


def test_claims_hold_or_not_as_the_numbers_say(tmp_path):
    def job(method, dataset, **changes):
        report = fabricate(**{"placed": 3, **changes})
        leave(tmp_path, "table1", [f"+method={method}", f"dataset={dataset}"], report)

    job("fcpma", "bunny", errors=(0.008, 0.4), num_pairs=3, seconds=1, model_points=10)
    job("ocpma", "bunny", errors=(0.008, 0.4), num_pairs=3, seconds=2, model_points=11)
    job("ocpra", "bunny", errors=(0.008, 0.4), num_pairs=3, seconds=3, model_points=99)
    found = verdicts(page(tmp_path, tmp_path / "out"))
    assert found["every scan is placed, no fal"][0] == "holds"
    assert found["e_R and e_t are at most 1.25"][0] == "holds"
    assert found["FCPMA is faster than OCPMA, "][0] == "holds"
    assert found["merging keeps the model smal"][0] == "holds"
    verdict, claim = found["FCPMA attempts few more than"]
    assert verdict == "holds" and "bunny 3 (N - 1 = 2)" in claim and "dragon not measured" in claim
    # One data set is enough against a claim.
    job("fcpma", "dragon", errors=(0.03, 0.4), num_pairs=4, seconds=5, model_points=10)
    job("ocpma", "dragon", errors=(0.01, 0.4), seconds=2, model_points=99, angle=90)
    job("ocpra", "dragon", errors=(0.01, 0.4), seconds=3, model_points=11)
    found = verdicts(page(tmp_path, tmp_path / "out"))
    assert {verdict for verdict, _ in found.values()} == {"does not hold"}
    assert (
        "*dragon (ocpra 3 of 3, 0 false positives; ocpma 3 of 3, 1 false positives"
        in (found["every scan is placed, no fal"][1])
    )
    assert "bunny (fcpma 1.0, ocpma 2.0, ocpra 3.0); *dragon (fcpma 5.0" in (
        found["FCPMA is faster than OCPMA, "][1].replace("buddha not measured; ", "")
    )


def test_a_method_that_gave_up_early_is_not_called_faster(tmp_path):
    for method, placed, seconds in (("fcpma", 2, 1), ("ocpma", 3, 2), ("ocpra", 3, 3)):
        leave(tmp_path, "table1", [f"+method={method}", "dataset=bunny"],
              fabricate(placed=placed, seconds=seconds))  # fmt: skip
    assert verdicts(page(tmp_path, tmp_path / "out"))["FCPMA is faster than OCPMA, "[:28]][0] == (
        "not measured"
    )


def test_the_comparators_numbers_of_pairs_are_checked(tmp_path):
    for method, pairs in (("fcpma", 2), ("spant", 2), ("surfc", 3)):
        leave(tmp_path, "table2", [f"+method={method}", "dataset=bunny"],
              fabricate(placed=3, num_pairs=pairs))  # fmt: skip
    found = verdicts(page(tmp_path, tmp_path / "out", "table2"))
    assert found["SurfC registers all N(N - 1)"][0] == "holds"
    assert found["SpanT attempts more pairs th"][0] == "does not hold"
    assert "bunny 3 (N(N - 1)/2 = 3)" in found["SurfC registers all N(N - 1)"][1]


def test_missing_data_says_so_without_the_machines_paths(tmp_path):
    message = (
        "dataset=armadillo is not on this machine, and downloading it failed: no network; see "
        "http://example.org/pub/scans.tar.gz and /home/me/.cache/x\n  searched: /home/me/data\n"
    )
    for method in ("ocpra", "fcpma"):
        leave(tmp_path, "table1", [f"+method={method}", "dataset=armadillo"], error=message)
    text = page(tmp_path, tmp_path / "out")
    assert rows(text)["armadillo", "fcpma"][2] == "*not on this machine*"
    (line,) = [line for line in text.splitlines() if line.startswith("- dataset=armadillo")]
    assert line.endswith(": ocpra armadillo, fcpma armadillo")
    assert "http://example.org/pub/scans.tar.gz and (a folder)" in line
    assert "/home" not in text


def test_a_method_that_is_not_installed_says_so(tmp_path):
    with pytest.raises(InputError) as caught:
        from omegaconf import OmegaConf

        from mvreg.config.known_plugins import refuse_stand_in

        refuse_stand_in(OmegaConf.create({"method": "surfc", "strategy": None}))
    leave(tmp_path, "table2", ["+method=surfc", "dataset=bunny"], error=str(caught.value))
    assert rows(page(tmp_path, tmp_path / "out", "table2"))["bunny", "surfc"][2] == (
        "*not installed*"
    )


def test_the_page_says_where_the_numbers_come_from(tmp_path):
    leave(tmp_path, "table1", ["+method=fcpma", "dataset=bunny"], fabricate())
    text = page(tmp_path, tmp_path / "out")
    assert "- Date: 2001-02-03\n" in text
    assert "- Machine: Abacus 3, 2 cores, 1 threads a run, Linux\n" in text
    assert "- Commit: 0123456789ab\n" in text
    assert "numpy" in text.partition("- Versions: ")[2]
    assert "the code has changed since commit 0123456789ab" in text  # which nobody knows
    leave(tmp_path, "table1", ["+method=fcpma", "dataset=dragon"],
          fabricate(commit="f" * 12 + "-changed"))  # fmt: skip
    text = page(tmp_path, tmp_path / "out")
    assert "runs are of several commits" in text
    assert "(1 runs)" in text and "changes that commit ffffffffffff lacks" in text


def test_runs_of_this_very_commit_need_no_note(tmp_path):
    from experiments.common.sources import differs
    from mvreg.report.provenance import git

    head = git(ROOT, "rev-parse", "HEAD")
    if head is None:
        pytest.skip("needs git and a checkout")
    changed = git(ROOT, "status", "--porcelain", "--untracked-files=no", "--", "mvreg", "conf",
                  "plugins", "pyproject.toml", "setup.py")  # fmt: skip
    assert differs(head, ROOT) == bool(changed)


def test_the_report_is_the_same_again_and_has_a_page_for_each_experiment(tmp_path):
    leave(tmp_path, "delta", ["+method=fcpma", "dataset=bunny", "seed.top_fraction=0.3"],
          fabricate(seconds=3))  # fmt: skip
    leave(tmp_path, "delta", ["+method=fcpma", "dataset=bunny", "seed.top_fraction=1.0"],
          fabricate(seconds=6))  # fmt: skip
    out = tmp_path / "out"
    text = page(tmp_path, out, "delta")
    assert rows(text)["0.3", "2 of 3"] and rows(text)["1.0", "2 of 3"]
    assert " 2.00 |" in text
    before = {file.name: file.read_text() for file in out.iterdir()}
    from experiments.report.pages import PAGES
    from experiments.report.robust_pages import ROBUST

    pages = [*PAGES, *ROBUST]
    assert sorted([*PAGES, *(name for each in ROBUST.values() for name in each.experiments)]) == (
        NAMES
    )  # each experiment has a page, and one only
    assert set(before) == {f"{name}.md" for name in [*pages, "README"]}
    for name in pages:
        assert f"({name}.md)" in before["README.md"]
    page(tmp_path, out)
    assert {file.name: file.read_text() for file in out.iterdir()} == before


def test_figures_are_shown_below_the_table_they_belong_to(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    for name in ("table1_errors.svg", "table2_cross_sections.png", "noise.csv"):
        (out / name).touch()
    assert "![table1 errors](table1_errors.svg)" in page(tmp_path, out)
    assert "Figures" not in page(tmp_path, out, "noise")


def test_the_floor_is_named_where_errors_are_compared_with_it(tmp_path):
    out = tmp_path / "out"
    assert "floor.md" not in page(tmp_path, out) + (out / "README.md").read_text()
    (out / "floor.md").touch()
    assert "(floor.md)" in page(tmp_path, out) and "(floor.md)" in (out / "README.md").read_text()
    assert "(floor.md)" not in page(tmp_path, out, "delta")


def test_the_printed_figures_agree_with_each_other():
    from experiments.report import printed

    assert len(printed.TABLE1) == len(printed.TABLE2) == 12 and len(printed.TABLE3) == 15
    for name in printed.SCANS:  # FCPMA is in both tables
        assert printed.TABLE1[name, "fcpma"] == printed.TABLE2[name, "fcpma"]
    for method in ("surfc", "spant", "fcpma"):  # order 1 is the files'
        assert printed.TABLE3["1", method][:2] == printed.TABLE2["bunny", method][:2]
