"""One browser for all pages."""

import os
import shutil

import pytest
from playwright.sync_api import sync_playwright

CHROMIUM = shutil.which(os.environ.get("CHROMIUM", "chromium"))


@pytest.fixture(scope="session")
def browser():
    assert CHROMIUM, "no chromium on the path; install it, or name a browser by CHROMIUM=..."
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=CHROMIUM,
            args=["--no-sandbox", "--headless", "--autoplay-policy=no-user-gesture-required"],
        )
        yield browser
        browser.close()
