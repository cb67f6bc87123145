"""The page of a run in a browser: drawn, turned, chosen from, and worked by the keyboard."""

from __future__ import annotations

import browsing
from browsing import canvas, changed, drawn, find, pick

import mvreg


def names(browser):
    rows = browser.find_elements("css selector", "#scans tbody tr")
    return [row.get_attribute("data-scan") for row in rows if row.is_displayed()]


def test_it_comes_up_soon_and_draws_the_scans(browser, figurine):
    browsing.resize(browser, 1300)
    browsing.visit(browser, figurine[0])
    # The machine may be busy with other tests: one visit that is soon enough shows it.
    assert any(browsing.visit(browser, figurine[0]) < 2.0 for _ in range(10))
    assert browser.get_log("browser") == []
    assert figurine[0].stat().st_size < 4e6
    assert 0.05 < drawn(canvas(browser)) < 0.9


def test_a_scan_in_the_view_and_its_row_are_chosen_together(page):
    from selenium.webdriver import ActionChains

    before = canvas(page)
    view = find(page, "#view")
    ActionChains(page).move_to_element(view).click().perform()
    (row,) = page.find_elements("css selector", "#scans tr.chosen")
    name = row.get_attribute("data-scan")
    assert row.get_attribute("aria-selected") == "true"
    assert find(page, "#note").text.startswith(name)
    assert changed(canvas(page), before) > 0.02  # the others are dimmed
    row.click()
    assert not page.find_elements("css selector", "#scans tr.chosen")
    assert changed(canvas(page), before) < 1e-3
    find(page, "#scans tr[data-scan] td:nth-child(3)").click()
    assert changed(canvas(page), before) > 0.02
    node = find(page, f"circle[data-scan='{names(page)[0]}']")
    assert node.get_attribute("stroke-width") == "5"


def test_colours_size_and_visible_scans_change_what_is_drawn(page):
    seen = {"scan": canvas(page)}
    for mode in ("grade", "residual", "the file's colours"):
        pick(page, "#colour", mode)
        seen[mode] = canvas(page)
        assert find(page, "[data-legend]:not([hidden])").is_displayed()
        for other, picture in seen.items():
            assert other == mode or changed(seen[mode], picture) > 0.02, (mode, other)
    page.execute_script("document.getElementById('everything').click()")
    assert drawn(canvas(page)) < 0.02
    page.execute_script("document.querySelector('[data-show]').click()")
    assert 0.02 < drawn(canvas(page)) < drawn(seen["scan"])


def test_the_table_is_filtered_and_sorted(page, figurine):
    every = names(page)
    assert sorted(every) == sorted(row["name"] for row in figurine[1]["scans"])
    find(page, "#filter").send_keys("_1")
    assert names(page) == [name for name in every if "_1" in name]
    find(page, "#filter").clear()
    find(page, "#filter").send_keys(" \b")
    heads = page.find_elements("css selector", "#scans th button")
    heads[0].click()
    assert names(page) == sorted(every)
    heads[0].click()
    assert names(page) == sorted(every, reverse=True)
    parent = heads[0].find_element("xpath", "..")
    assert parent.get_attribute("aria-sort") == "descending"
    rms = next(head for head in heads if head.text.startswith("RMS"))
    rms.click()
    found = {row["name"]: round(row["assessment"]["rms"], 3) for row in figurine[1]["scans"]}
    values = [found[name] for name in names(page)]
    assert values == sorted(values)


def test_it_is_worked_by_the_keyboard(page):
    from selenium.webdriver import Keys

    view = find(page, "#view")
    pictures = [canvas(page)]
    for key in (Keys.ARROW_RIGHT, Keys.ARROW_UP, "+", "-"):
        view.send_keys(key)
        pictures.append(canvas(page))
        assert changed(pictures[-1], pictures[-2]) > 0.01, key
    view.send_keys("r")
    assert changed(canvas(page), pictures[0]) < 0.01
    row = find(page, "#scans tbody tr")
    row.send_keys(Keys.ENTER)
    assert "chosen" in row.get_attribute("class")
    row.send_keys(Keys.SPACE)
    assert "chosen" not in row.get_attribute("class")


def test_refused_poses_and_parts_are_shown(browser, parted):
    browsing.resize(browser, 1300)
    browsing.visit(browser, parted[0])
    model = canvas(browser)
    pick(browser, "#scene", "component 2")
    part = canvas(browser)
    assert drawn(part) > 0.02 and changed(part, model) > 0.02
    button = find(browser, "button[data-scene]")
    button.click()
    scene = find(browser, "#scene")
    assert scene.get_attribute("value") == button.get_attribute("data-scene")
    assert "refused" in scene.text
    assert drawn(canvas(browser)) > 0.02 and changed(canvas(browser), part) > 0.02
    box = find(browser, "#refused")
    line = find(browser, ".refused")
    hidden = line.value_of_css_property("display")
    box.click()
    assert (hidden, line.value_of_css_property("display")) == ("none", "inline")
    assert browser.get_log("browser") == []


def test_one_row_is_reached_by_tab_and_the_others_by_arrows(page):
    from selenium.webdriver import ActionChains, Keys

    def press(key):
        ActionChains(page).send_keys(key).perform()
        return page.switch_to.active_element

    for place, kind in (("#scans tbody", "tr[data-scan]"), ("#graph", "circle[data-scan]")):
        every = page.find_elements("css selector", f"{place} {kind}")
        reached = page.find_elements("css selector", f"{place} {kind}[tabindex='0']")
        assert reached == every[:1]
        page.execute_script("arguments[0].focus()", every[0])
        assert press(Keys.ARROW_DOWN) == every[1]
        assert press(Keys.END) == every[-1] == press(Keys.ARROW_DOWN)
        assert press(Keys.ARROW_UP) == every[-2]
        assert page.find_elements("css selector", f"{place} {kind}[tabindex='0']") == [every[-2]]
        press(Keys.ENTER)
        name = every[-2].get_attribute("data-scan")
        assert find(page, "#note").text.startswith(name)
        press(Keys.ENTER)
    assert find(page, "#filter").get_attribute("value") == ""


def test_what_is_reached_by_tab_is_outlined(page):
    from selenium.webdriver import ActionChains, Keys

    page.execute_script("document.activeElement.blur(); window.scrollTo(0, 0)")
    seen = {}
    for _ in range(60):
        ActionChains(page).send_keys(Keys.TAB).perform()
        one = page.switch_to.active_element
        key = (one.tag_name, one.get_attribute("id"), one.text[:20])
        if key in seen or one.tag_name == "body":
            break
        seen[key] = one.value_of_css_property("outline-style")
    tags = {tag for tag, *_ in seen}
    assert {"select", "input", "button", "canvas", "tr", "circle"} <= tags
    assert {key for key, style in seen.items() if style == "none"} == set()


def test_links_that_wait_come_when_they_are_asked_for(
    browser, figurine, written, tmp_path, monkeypatch
):
    from mvreg.report.page import render

    monkeypatch.setattr(render, "AT_FIRST", 3)
    scans = mvreg.dataset("tiny")
    file, report = written(tmp_path, scans)
    total = len(report["links"])
    assert total > 3

    def rows():
        return len(browser.find_elements("css selector", "#links tbody tr"))

    for ask in ("[data-more=links]", "#links th button"):
        browsing.visit(browser, file)
        assert rows() == 3
        assert f"show all {total} links" in find(browser, "[data-more=links]").text
        browser.execute_script("document.querySelector(arguments[0]).click()", ask)
        assert rows() == total
        assert not browser.find_elements("css selector", "[data-more=links]")
    values = [
        row.find_element("css selector", "td").text
        for row in browser.find_elements("css selector", "#links tbody tr")
    ]
    assert values == sorted(values)
