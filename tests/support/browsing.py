"""A headless Chromium for the tests of the page; they skip where there is none."""

from __future__ import annotations

import base64
import io
import shutil
import time
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

FLAGS = (
    "--headless", "--no-sandbox", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
)  # fmt: skip
#: The background of the view.
GROUND = (17, 21, 28)
MISSING = "NOT TESTED: the page in a browser; install Chromium, its chromedriver, and selenium"


def start(profile: Path):
    """A driver of a browser with a profile of its own, off the network."""
    webdriver = pytest.importorskip("selenium.webdriver", reason=MISSING)
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not chromium or not driver:
        pytest.skip(MISSING)
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for flag in (*FLAGS, f"--user-data-dir={profile}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    service = webdriver.chrome.service.Service(driver)
    browser = webdriver.Chrome(options=options, service=service)
    browser.execute_cdp_cmd("Network.enable", {})
    offline = {"offline": True, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0}
    browser.execute_cdp_cmd("Network.emulateNetworkConditions", offline)
    return browser


def resize(browser, width, height=900):
    """Look at the page as on a screen of this size; below 700 pixels, as a phone does."""
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 700}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)


def visit(browser, file):
    """Open a page from its file; the seconds until its scripts have run."""
    browser.get_log("browser")
    begun = time.perf_counter()
    browser.get(Path(file).resolve().as_uri())
    for _ in range(100):
        if browser.execute_script("return document.documentElement.dataset.ready") == "true":
            return time.perf_counter() - begun
        time.sleep(0.05)
    raise AssertionError(f"{file} does not come up: {browser.get_log('browser')}")


def drawn_pixels(canvas):
    """What a canvas shows: (H, W, 3) array of 8 bits."""
    url = canvas.parent.execute_async_script(
        """const [canvas, done] = arguments;
        requestAnimationFrame(() => requestAnimationFrame(() => done(canvas.toDataURL())));""",
        canvas,
    )
    return picture(base64.b64decode(url.partition(",")[2]))


def picture(png):
    """A PNG as (H, W, 3) array of 8 bits."""

    image = matplotlib.image.imread(io.BytesIO(png), format="png")
    return np.round(255 * image[..., :3]).astype(np.uint8)


def find(browser, selector):
    return browser.find_element("css selector", selector)


def pick(browser, selector, text):
    """Choose an option of a list by its text."""
    for option in find(browser, selector).find_elements("tag name", "option"):
        if option.text == text:
            option.click()
            return
    raise AssertionError(f"{selector} offers no {text!r}")


def canvas(browser):
    return drawn_pixels(find(browser, "#view"))


def drawn(picture):
    """Share of the pixels that are not the background."""
    return (np.abs(picture.astype(int) - GROUND).max(axis=2) > 8).mean()


def changed(one, other):
    return (np.abs(one.astype(int) - other.astype(int)).max(axis=2) > 8).mean()
