"""The documentation in a browser: nothing comes from elsewhere, equations are set, pictures are sharp."""

from pathlib import Path

import pytest

HTML = Path(__file__).parents[2] / "docs" / "_build" / "html"
PAGES = sorted(page.stem for page in HTML.parents[1].glob("*.md"))
DESKTOP, PHONE = {"width": 1280, "height": 900}, {"width": 375, "height": 740}

TYPESET = """() => ({
    asked: document.querySelectorAll('.math').length,
    set: document.querySelectorAll('.math mjx-container').length,
    wrong: document.querySelectorAll('mjx-merror').length,
})"""
#: What reaches beyond the window, and cannot be scrolled within a box of its own.
WIDE = """() => [...document.querySelectorAll('.content *')].filter(part => {
    if (part.getBoundingClientRect().right <= innerWidth + 1) return false;
    for (let box = part.parentElement; box; box = box.parentElement)
        if (/auto|scroll|hidden/.test(getComputedStyle(box).overflowX)) return false;
    return getComputedStyle(part).position !== 'absolute';
}).map(part => part.outerHTML.slice(0, 90))"""
PICTURES = """() => [...document.querySelectorAll('article img')].map(picture => ({
    name: picture.getAttribute('src'), natural: picture.naturalWidth, shown: picture.clientWidth,
}))"""


@pytest.mark.parametrize("viewport", [DESKTOP, PHONE], ids=["desktop", "phone"])
@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_whole(browser, name, viewport):
    assert (HTML / f"{name}.html").exists(), "the pages are built by `make pages`"
    wrong = []
    context = browser.new_context(viewport=viewport)
    page = context.new_page()
    page.on("console", lambda message: message.type == "error" and wrong.append(message.text))
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on(
        "request", lambda request: request.url.startswith(("file:", "data:")) or wrong.append(request.url)
    )
    page.on("requestfailed", lambda request: wrong.append(f"missing: {request.url}"))
    page.goto((HTML / f"{name}.html").as_uri())
    if page.evaluate(TYPESET)["asked"]:
        page.wait_for_function("() => window.MathJax?.startup?.promise")
        page.evaluate("() => MathJax.startup.promise")
    # Pictures far below are loaded when they are needed.
    page.evaluate("() => { for (const picture of document.images) picture.loading = 'eager'; }")
    page.wait_for_function("() => [...document.images].every(picture => picture.complete)")
    equations = page.evaluate(TYPESET)
    assert equations["asked"] or "$$" not in (HTML.parents[1] / f"{name}.md").read_text(encoding="utf-8")
    assert equations["set"] == equations["asked"]
    assert equations["wrong"] == 0
    pictures = page.evaluate(PICTURES)
    assert pictures or name not in ("examples", "gallery", "notation", "tutorial")
    for picture in pictures:
        assert picture["natural"] > 0, picture
        # A drawing of lines has any size; a picture has a point for each of the screen.
        assert picture["name"].endswith(".svg") or picture["natural"] >= 0.99 * picture["shown"], picture
    assert page.evaluate(WIDE) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= viewport["width"]
    context.close()
    assert wrong == []
