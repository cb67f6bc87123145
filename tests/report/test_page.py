"""The page of a run: what it says, and that it is complete in itself."""

from __future__ import annotations

import base64
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest

import mvreg
from mvreg.cli import main as cli
from mvreg.evidence.pooled import CONSISTENT
from mvreg.geometry import se3
from mvreg.report.build import build_report
from mvreg.report.page import words
from mvreg.report.page.colours import colour
from mvreg.report.page.data import page_data
from mvreg.report.page.drawings import drawn
from mvreg.report.page.graph import BORDER, WIDE, graph
from mvreg.report.page.layout import layout
from mvreg.report.page.pairs import refused_rows
from mvreg.report.page.render import render_page
from mvreg.report.page.scenes import hypotheses, upright
from mvreg.report.page.sections import Section, sections
from mvreg.report.page.shown import NONE, Shown, packed
from mvreg.report.summary import totals
from mvreg.types import Scan


class Page(HTMLParser):
    """The tags and texts of a page; tags must close as they open."""

    VOID = ("meta", "link", "input", "br")

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.texts, self.scripts = [], [], [], {}
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop()[0] == tag

    def handle_data(self, data):
        if self.open and self.open[-1][0] == "script":
            self.scripts[self.open[-1][1].get("id")] = data
        elif self.open and self.open[-1][0] != "style":
            self.texts.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.texts).split())


def run(scans, **changes):
    result = mvreg.register(scans, changes=changes)
    report = build_report(
        scans, result.views, result, method="auto", rng=0, seconds={"total": 1.0}, config={}
    )
    return report, result


@pytest.fixture(scope="module")
def mixed():
    """Two objects, of which one is the smaller part, and a scan of a third."""
    scans = mvreg.dataset(
        "mixture", of=["tiny views=4", "tiny views=3 shape=blob-0", "tiny views=1 shape=blob-2"]
    )
    return scans, *run(scans)


def page_of(scans, report, result, **more):
    return page_data(report, scans, result.views, **more)


def test_the_page_says_what_the_report_says(mixed):
    scans, report, result = mixed
    data = page_of(scans, report, result, overrides=["dataset=mixture"], hashes={"a": "b"})
    page = Page(render_page(data))
    apart = [name for part in result.components for name in part]
    assert result.unregistered and apart
    assert data.verdict in page.text
    placed, lost = len(result.poses), len(result.unregistered)
    assert f"{placed} of {len(scans.scans)} scans are placed in one model" in data.verdict
    assert f"{lost} {'is' if lost == 1 else 'are'} not placed" in data.verdict
    rows = [attrs for tag, attrs in page.tags if tag == "tr" and "data-scan" in attrs]
    assert {row["data-scan"] for row in rows} == {scan.name for scan in scans.scans}
    assert [row["data-scan"] for row in rows][: len(data.lost)] == [x["name"] for x in data.lost]
    nodes = [attrs["data-scan"] for tag, attrs in page.tags if tag == "circle"]
    assert sorted(nodes) == sorted(scan.name for scan in scans.scans)
    assert "dataset=mixture" in page.text
    for name in result.unregistered:
        assert f"For {name}" in page.text or f"poses of {name}" in page.text or len(data.lost) > 1


def test_the_page_needs_nothing_from_elsewhere(mixed):
    scans, report, result = mixed
    text = render_page(page_of(scans, report, result))
    page = Page(text)
    for tag, attrs in page.tags:
        for key in ("src", "href"):
            assert attrs.get(key, "data:,").startswith("data:"), (tag, attrs)
    assert "http" not in re.sub(r"<script type=.*?</script>", "", text, flags=re.DOTALL)
    assert len(text) < 4e6


def test_scenes_show_parts_files_and_refused_poses(mixed):
    scans, report, result = mixed
    data = page_of(scans, report, result)
    titles = [scene["title"] for scene in data.scenes]
    assert titles[0] == "the model" and titles[1] == "component 2"
    shown = {item["scan"]: item["pose"] for item in data.scenes[0]["items"]}
    assert shown.keys() == result.poses.keys()
    for name, pose in result.poses.items():
        np.testing.assert_allclose(shown[name], pose.reshape(-1))
    before = next(scene for scene in data.scenes if scene["title"].startswith("before"))
    assert len(before["items"]) == len(scans.scans)
    for one in data.lost:
        for attempt in one["attempts"]:
            moved = data.scenes[attempt["scene"]]["items"]
            assert [item["scan"] for item in moved] == [attempt["target"], attempt["source"]]
            np.testing.assert_allclose(
                np.reshape(moved[1]["pose"], (4, 4)), attempt["T_target_source"]
            )


def attempt(source, target, confidence, **more):
    return {
        "source": source, "target": target, "verdict": "rejected", "confidence": confidence,
        "reason": f"{confidence}", "T_target_source": np.eye(4).tolist(),
    } | more  # fmt: skip


def test_a_pair_tried_again_is_shown_once_by_its_best_attempt():
    tried = [
        attempt("a", "b", 0.2), attempt("b", "a", 0.4), attempt("a", "b", 0.1),
        attempt("c", "a", None), attempt("b", "c", 0.3, verdict="accepted"),
        attempt("d", "a", 0.5, T_target_source=None), attempt("d", "a", 0.5, reason="last"),
        attempt("a", "d", 0.5, T_target_source=None),
    ]  # fmt: skip
    found = refused_rows({"pairs": tried})
    assert [(pair["source"], pair["target"], pair["tries"]) for pair in found] == [
        ("d", "a", 3), ("b", "a", 3), ("c", "a", 1),
    ]  # fmt: skip
    assert (found[0]["reason"], found[1]["reason"]) == ("last", "0.4")
    best = hypotheses("a", {"pairs": tried})
    assert [frozenset((pair["source"], pair["target"])) for pair in best] == [
        frozenset("ad"), frozenset("ab"), frozenset("ac"),
    ]  # fmt: skip
    assert [pair["tries"] for pair in best] == [1, 3, 1]  # those that found a pose


def test_every_answer_of_an_ambiguous_scan_can_be_looked_at(mixed):
    scans, report, result = mixed
    lost, other = result.unregistered[0], result.reference
    turned = np.diag([-1.0, -1.0, 1.0, 1.0]).tolist()
    answers = [
        {"confidence": share, "angle_deg": angle, "apart": angle / 10, "T_target_source": pose}
        for share, angle, pose in ((0.51, 0.0, np.eye(4).tolist()), (0.48, 180.0, turned))
    ]
    pair = attempt(lost, other, 0.9, reason="ambiguous: two", answers=answers, evidence={})
    told = {"source": lost, "target": other, "poses": answers}
    ambiguous = {"status": "ambiguous", "answers": told}
    rows = [row | ambiguous if row["name"] == lost else row for row in report["scans"]]
    symmetric = report | {"pairs": [pair], "scans": rows}
    data = page_of(scans, symmetric, result)
    (one,) = [each for each in data.lost if each["name"] == lost]
    assert [each["confidence"] for each in one["attempts"]] == [0.51, 0.48]
    shown = [data.scenes[each["scene"]] for each in one["attempts"]]
    assert shown[1]["title"] == f"{lost} on {other}, answer 2 of 2"
    np.testing.assert_array_equal(np.reshape(shown[1]["items"][1]["pose"], (4, 4)), turned)
    page = Page(render_page(data))
    assert page.text.count("answer 1 of 2") == 2, "in the list of scenes, and as a button"
    assert page.text.count(f"{lost} on {other}: ambiguous: two") == 1
    lines = "\n".join(str(line) for line in totals(symmetric))
    assert f"2 poses of {lost} on {other} are left: confidence 0.51; 0.48 for 180.0 deg" in lines


def test_refused_pairs_are_listed_and_drawn_once(mixed):
    scans, report, result = mixed
    first = next(pair for pair in report["pairs"] if pair["verdict"] == "rejected")
    again = first | {"source": first["target"], "target": first["source"]}
    more = report | {"pairs": [*report["pairs"], again]}
    pages = [page_of(scans, one, result) for one in (report, more)]
    drawn = []
    for data in pages:
        page = Page(render_page(data))
        drawn.append(sum(attrs.get("class") == "refused" for _, attrs in page.tags))
        assert f"The {drawn[-1]} refused pairs of scans" in page.text
    assert drawn[0] == drawn[1] == len(pages[1].refused) > 0
    tries = max(pair["tries"] for pair in pages[1].refused)
    assert f"refused in {tries} attempts" in page.text
    assert [sum(pair["tries"] for pair in data.refused) for data in pages] == [
        sum(pair["verdict"] == "rejected" for pair in one["pairs"]) for one in (report, more)
    ]


def test_names_are_shown_as_they_are():
    scans = mvreg.dataset("tiny", views=3)
    odd = ["<script>alert(1)</script>", "a\"b' & c", "</script> {{ 1 }}"]
    named = tuple(Scan(name, scan.points) for name, scan in zip(odd, scans.scans, strict=True))
    report, result = run(mvreg.types.ScanSet("<b>odd</b>", named))
    page = Page(render_page(page_of(mvreg.types.ScanSet("odd", named), report, result)))
    assert {a["data-scan"] for t, a in page.tags if t == "tr" and "data-scan" in a} == set(odd)
    assert set(json.loads(page.scripts["points"])["scans"]) == set(odd)


def test_points_are_packed_to_a_part_in_65535():
    rng = np.random.default_rng(0)
    points = rng.uniform(-3, 5, (100, 3)) + np.array([5e6, 0, 0])
    residuals = np.where(np.arange(100) % 3, rng.uniform(0, 1, 100), np.nan)
    colours = rng.integers(0, 256, (100, 3)).astype(np.uint8)
    found = packed(Shown("a", points, np.eye(3)[np.zeros(100, int)], residuals, colours), 2.0)
    read = np.frombuffer(base64.b64decode(found["points"]), "<u2").reshape(-1, 3)
    again = np.array(found["low"]) + read / 65535 * found["side"]
    np.testing.assert_allclose(again, points, atol=found["side"] / 65535)
    steps = np.frombuffer(base64.b64decode(found["residuals"]), np.uint8)
    np.testing.assert_array_equal(steps == NONE, np.isnan(residuals))
    known = steps != NONE
    np.testing.assert_allclose(steps[known] / 254 * 2.0, residuals[known], atol=0.01)
    np.testing.assert_array_equal(
        np.frombuffer(base64.b64decode(found["colours"]), np.uint8).reshape(-1, 3), colours
    )


def test_sections_are_where_surfaces_are_apart():
    scans = mvreg.dataset("tiny", scramble=True, rng=1)
    views = mvreg.prepare(scans)
    name = scans.scans[1].name
    shift = se3.from_parts(np.eye(3), np.array([1.5, 0, 0]))
    poses = {**scans.poses, name: shift @ scans.poses[name]}
    residuals = mvreg.evaluation.residuals.point_residuals(poses, views)
    shown = [Shown(scan.name, scan.points, scan.points, np.empty(0), None) for scan in scans.scans]
    found = sections(poses, views, residuals, shown)
    assert 1 <= len(found) <= 3
    assert found[0].apart > 0.5
    for one in found:
        assert any(name in part for part in (one.enlarged, one.whole))
        for points in one.enlarged.values():
            assert np.abs(points).max() <= one.half
    right = mvreg.evaluation.residuals.point_residuals(scans.poses, views)
    fine = sections(scans.poses, views, right, shown)
    assert np.mean([one.apart for one in fine]) < np.mean([one.apart for one in found])


def test_the_graph_is_drawn_apart_and_the_same_each_time():
    names = [f"scan {k}" for k in range(40)]
    links = [(names[k], names[k + 1]) for k in range(30)]
    places = layout(names, links, {name: np.zeros(3) for name in names[:5]})
    assert places == layout(names, links, {name: np.zeros(3) for name in names[:5]})
    points = np.array(list(places.values()))
    assert points.min() == 0 and points.max() == 1
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)[np.triu_indices(40, 1)]
    assert apart.min() > 0.02
    linked = np.mean([np.linalg.norm(points[k] - points[k + 1]) for k in range(30)])
    assert linked < 0.6 * apart.mean()
    assert layout(["a"], [], {}) == {"a": (0.5, 0.5)} and layout([], [], {}) == {}


def test_parts_that_nothing_links_lie_beside_each_other():
    names = [f"scan {k}" for k in range(30)]
    links = [(names[k], names[k + 1]) for k in (*range(19), *range(20, 25))]
    places = layout(names, links, {})
    parts = [np.array([places[name] for name in names[a:b]]) for a, b in ((0, 20), (20, 26))]
    (low, high), (other_low, other_high) = [(p.min(axis=0), p.max(axis=0)) for p in parts]
    assert (low > other_high).any() or (other_low > high).any()
    alone = np.array([places[name] for name in names[26:]])
    for a, b in ((low, high), (other_low, other_high)):
        assert not ((alone >= a) & (alone <= b)).all(axis=1).any()


def test_many_links_are_drawn_thin_and_doubtful_ones_on_top():
    scans = [{"name": f"s{k}", "grade": "red" if k < 2 else "green"} for k in range(80)]
    sure = [
        {"source": f"s{a}", "target": f"s{b}", "confidence": 0.99, "contact_ratio": 0.5}
        for a in range(80) for b in range(a)
    ]  # fmt: skip
    doubtful = {"source": "s0", "target": "s1", "confidence": None, "contact_ratio": 0.5}
    middling = {"source": "s2", "target": "s3", "confidence": 0.6, "contact_ratio": 0.5}
    found = graph(scans, [doubtful, middling, *sure], {})
    assert len(found.lines) < 10 and set(found.labels) == {"s0", "s1"}
    assert [line.link for line in found.lines[-2:]] == [middling, doubtful]
    assert sum(line.path.count("M") for line in found.lines) == len(sure) + 2
    few = graph(scans[:5], [link for link in sure if int(link["source"][1:]) < 5], {})
    assert len(few.lines) == 10 and all(line.link for line in few.lines)
    assert few.lines[0].width > 2 * found.lines[0].width and few.opacity > found.opacity
    assert set(few.labels) == {f"s{k}" for k in range(5)}
    for name, label in few.labels.items():
        x = few.nodes[name][0]
        wanted = "start" if x < BORDER else "end" if x > WIDE - BORDER else "middle"
        assert label.anchor == wanted
    assert {"start", "end"} <= {label.anchor for label in few.labels.values()}


def test_cameras_stand_upright_whichever_way_they_look():
    points = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    for scan, up in (
        (Scan("a", points, view_direction=np.array([0.0, 0.0, 1.0])), [0, 1, 0]),
        (Scan("a", points + np.array([0, 0, 8]), view_point=np.zeros(3)), [0, -1, 0]),
        (Scan("a", points - np.array([0, 0, 8]), view_point=np.zeros(3)), [0, 1, 0]),
        (Scan("a", points + np.array([8, 0, 0]), view_point=np.zeros(3)), [0, 0, 1]),
        (Scan("a", points, up=np.array([1.0, 0.0, 0.0])), [1, 0, 0]),
        (Scan("a", points), [0, 0, 1]),
    ):
        scans = mvreg.types.ScanSet("one", (scan,))
        turn = upright(scans, {"reference": "a"}, {"a": np.eye(4)})[:3, :3]
        np.testing.assert_allclose(turn @ np.array(up), [0, 0, 1], atol=0.2)
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(turn) > 0


def test_what_is_long_is_seen_from_its_side():
    points = np.random.default_rng(0).uniform(-1, 1, (500, 3)) * [1, 5, 1]
    scans = mvreg.types.ScanSet("one", (Scan("a", points),))
    turn = upright(scans, {}, {"a": np.eye(4)})[:3, :3]
    assert abs(turn[0] @ [0, 1, 0]) > 0.99


def test_a_section_is_drawn_whole_with_its_enlarged_part_in_it():
    whole = {"a": np.array([[-1.0, -1.0], [9.0, 3.0]])}
    found = drawn(Section(np.zeros(3), 0.5, 1.0, whole, {"a": np.zeros((1, 2))}), {}, {})
    places = [int(x) for x in re.findall(r"\d+", found["whole"][0]["path"].replace("h0", ""))]
    assert min(places) >= 0 and max(places) <= 1000
    x, y, side = found["box"]
    assert side == pytest.approx(1000 * 2 / 10 / 1.05)
    # The part's middle, which is the origin, lies a tenth of the extent from the left border.
    assert x + side / 2 == pytest.approx(500 - 500 * 4 / 5 / 1.05)
    assert y + side / 2 == pytest.approx(500 + 500 * 1 / 5 / 1.05)


def test_levels_are_left_out_where_the_unit_is_not_known(mixed):
    scans, report, result = mixed
    texts = [
        Page(render_page(page_of(scans, report | {"unit": unit}, result))).text
        for unit in ("mm", "file")
    ]
    assert ["LOA" in text for text in texts] == [True, False]
    assert ["Say dataset.unit=mm" in text for text in texts] == [False, True]


def test_the_verdict_in_words():
    rows = [{"name": name, "status": "placed", "assessment": {"grade": "green"}} for name in "abc"]
    report = {"scans": rows, "poses": dict.fromkeys("abc"), "unit": "mm"}
    assert words.verdict(report) == "All 3 scans are placed in one model."
    assert words.next_steps(report) == []
    rows[1] = {"name": "b", "status": "placed", "assessment": {"grade": "red", "reason": "no"}}
    rows[2] = {"name": "c", "status": "ambiguous", "attempts": 2, "reason": "turned"}
    report["poses"] = dict.fromkeys("ab")
    report["components"] = [{"poses": {"d": 0}}]
    assert words.verdict(report) == (
        "2 of 3 scans are placed in one model, 1 more in another part, 1 is not placed; 1 of the "
        "poses is doubtful."
    )
    steps = " ".join(words.next_steps(report))
    assert "Do not use the poses of b" in steps and "Several poses of c fit" in steps
    assert [row["name"] for row in sorted(rows, key=words.importance)] == ["c", "b", "a"]
    assert words.doubt(rows[2]) == "2 attempts; the closest: turned"
    sure = {"status": "placed", "assessment": {"grade": "green", "reason": CONSISTENT}}
    assert words.doubt(sure) == CONSISTENT
    sure["assessment"]["reason"] = "normals disagree"
    assert words.doubt(sure) == "certain in spite of an objection: normals disagree"
    sure["assessment"]["grade"] = "amber"
    assert words.doubt(sure) == "normals disagree"
    alone = {**report, "poses": {"a": 0}, "components": []}
    assert words.verdict(alone).startswith("No two of the 3 scans are placed together")
    assert words.doubt({"status": "not placed"}, running=True) == "not tried yet"
    assert words.doubt({"status": "placed"}, running=True) == "not judged yet"


def test_colours_of_neighbours_differ():
    found = [colour(k) for k in range(60)]
    assert len(set(found)) == 60
    assert all(re.fullmatch("#[0-9a-f]{6}", one) for one in found)


def test_a_run_leaves_a_page_unless_told_not_to(tmp_path, capsys):
    arguments = ["dataset=tiny", "dataset.views=3", "rerun=false"]
    assert cli.main([*arguments, f"hydra.run.dir={tmp_path / 'with'}"]) == 0
    assert (tmp_path / "with" / "report.html").is_file()
    assert "open the report in a browser: " in capsys.readouterr().out
    assert cli.main([*arguments, "report=false", f"hydra.run.dir={tmp_path / 'without'}"]) == 0
    assert not (tmp_path / "without" / "report.html").exists()
    assert "dataset.views=3" in (tmp_path / "with" / "report.html").read_text(encoding="utf-8")
