"""How the page of a run looks: that it fits, stands out, is printed, and is as it was."""

from __future__ import annotations

import base64
from pathlib import Path

import browsing
import matplotlib.image
import numpy as np
import pytest
from browsing import canvas, find

GOLDEN = Path(__file__).parent / "golden"
CONTRAST = """
const light = (rgb) => {
  const part = rgb.slice(0, 3).map((v) => v / 255).map((v) => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
  return 0.2126 * part[0] + 0.7152 * part[1] + 0.0722 * part[2];
};
const numbers = (text) => (text.match(/[\\d.]+/g) || []).map(Number);
const behind = (one) => {
  for (; one; one = one.parentElement) {
    const found = numbers(getComputedStyle(one).backgroundColor);
    if (found.length === 3 || found[3] > 0.6) return found;
  }
  return [255, 255, 255];
};
const poor = [];
for (const one of document.querySelectorAll("body *")) {
  if (one.closest("script, svg") || !one.checkVisibility()) continue;
  if (![...one.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim())) continue;
  const [a, b] = [light(numbers(getComputedStyle(one).color)), light(behind(one))];
  const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  if (ratio < 4.5) poor.push([one.tagName, one.className, one.textContent.trim().slice(0, 30), ratio]);
}
return poor;
"""  # noqa: E501


@pytest.mark.parametrize("width", [1300, 700, 400])
@pytest.mark.parametrize("which", ["figurine", "parted"])
def test_nothing_reaches_beyond_the_page(browser, which, width, request):
    browsing.resize(browser, width)
    browsing.visit(browser, request.getfixturevalue(which)[0])
    wide = browser.execute_script("return document.documentElement.scrollWidth")
    assert wide <= width
    cut = browser.execute_script("""
      return [...document.querySelectorAll("svg text")].filter((one) => {
        const [a, b] = [one.getBoundingClientRect(), one.closest("svg").getBoundingClientRect()];
        return a.left < b.left - 1 || a.right > b.right + 1 || a.bottom > b.bottom + 1;
      }).map((one) => one.textContent);""")
    assert cut == []


@pytest.mark.parametrize("which", ["figurine", "parted"])
def test_text_stands_out(browser, which, request):
    browsing.resize(browser, 1300)
    browsing.visit(browser, request.getfixturevalue(which)[0])
    assert browser.execute_script(CONTRAST) == []


def test_it_is_printed(page):
    from selenium.webdriver.common.print_page_options import PrintOptions

    made = base64.b64decode(page.print_page(PrintOptions()))
    assert made.startswith(b"%PDF-") and len(made) > 20_000


#: What is compared with the golden pictures: rows of the picture that it is shrunk to, and how far
#: the mean may be off: fonts differ by machine, what is drawn in WebGL does not.
BLOCKS = {"#view": (48, 3.0), "#graph svg": (48, 12.0), "h1": (8, 40.0), ".steps": (8, 25.0),
          "#scans thead": (8, 25.0)}  # fmt: skip
COLUMNS, BACKGROUND = 64, 6.0


@pytest.mark.parametrize("font", ["", "serif", "monospace"])
@pytest.mark.parametrize(("name", "width"), [("desktop", 1000), ("phone", 400)])
def test_it_looks_as_it_did(browser, figurine, name, width, font, request, tmp_path):
    """Each part by itself, coarsely: as on machines with other fonts, which move what is below."""
    file = GOLDEN / f"page_{name}.png"
    browsing.resize(browser, width, 700)
    browsing.visit(browser, figurine[0])
    use_font(browser, font)
    found = parts(browser)
    if request.config.getoption("--renew-golden"):
        if not font:
            GOLDEN.mkdir(exist_ok=True)
            matplotlib.image.imsave(file, np.concatenate([*found.values()]).astype(np.uint8))
        pytest.skip(f"renewed {file.name}")
    golden = np.round(255 * matplotlib.image.imread(file)[..., :3])
    matplotlib.image.imsave(
        tmp_path / file.name, np.concatenate([*found.values()]).astype(np.uint8)
    )
    assert differing(found, golden) == {}, f"see {tmp_path / file.name}"


def test_another_look_is_noticed(browser, figurine):
    """Another colour of the scans, another place of the camera, another background."""
    golden = np.round(255 * matplotlib.image.imread(GOLDEN / "page_desktop.png")[..., :3])
    for change, part in (
        ("const c = document.getElementById('colour'); c.value = 'confidence';"
         "c.dispatchEvent(new Event('change'))", "#view"),
        ("document.getElementById('view').dispatchEvent(new KeyboardEvent('keydown',"
         "{key: 'ArrowRight'}))", "#view"),
        ("document.querySelector('.steps').style.background = '#fff7e0'", ".steps"),
        ("document.querySelector('#graph svg').replaceChildren()", "#graph svg"),
    ):  # fmt: skip
        browsing.resize(browser, 1000, 700)
        browsing.visit(browser, figurine[0])
        browser.execute_script(change)
        assert part in differing(parts(browser), golden), change


def use_font(browser, font):
    if font:
        browser.execute_script(
            "const style = document.createElement('style');"
            "style.textContent = `* { font-family: ${arguments[0]} !important }`;"
            "document.head.append(style)", font,
        )  # fmt: skip


def parts(browser):
    """The parts of the page that are compared, shrunk: (rows, COLUMNS, 3) arrays by selector."""
    found = {}
    for selector, (rows, _) in BLOCKS.items():
        if selector == "#view":
            picture = canvas(browser)
        else:
            picture = browsing.picture(find(browser, selector).screenshot_as_png)
        found[selector] = shrunk(picture, rows)
    return found


def differing(found, golden):
    """The parts whose mean, or whose background, is not that of the golden picture."""
    differ, first = {}, 0
    for selector, (rows, most) in BLOCKS.items():
        wanted = golden[first : first + rows]
        first += rows
        apart = np.abs(found[selector] - wanted).mean()
        ground = np.abs(
            np.median(found[selector], axis=(0, 1)) - np.median(wanted, axis=(0, 1))
        ).max()
        if apart > most or (selector != "h1" and ground > BACKGROUND):
            differ[selector] = (float(apart), float(ground))
    return differ


def shrunk(picture, rows):
    """Means of blocks of pixels, in which the shapes of letters are lost."""
    high, wide = picture.shape[:2]
    down = np.linspace(0, high, rows + 1).astype(int)[:-1]
    across = np.linspace(0, wide, COLUMNS + 1).astype(int)[:-1]
    sums = np.add.reduceat(np.add.reduceat(picture.astype(float), down, axis=0), across, axis=1)
    sizes = np.diff([*down, high])[:, None, None] * np.diff([*across, wide])[None, :, None]
    return (sums / sizes).round()
