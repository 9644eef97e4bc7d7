"""The report in a browser: nothing fails, nothing is loaded, every figure shows, the keyboard is enough."""

import io
import re

import numpy as np
import pytest
from paper.section import known
from PIL import Image

import stickslip as ss
from waiting import until

DESKTOP, PHONE = {"width": 1280, "height": 900}, {"width": 375, "height": 740}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Reports of scenes that differ in what they have to show."""
    folder = tmp_path_factory.mktemp("reports")
    scenes = {
        "standard": ss.models.two_subsystems(),
        "ill-posed": ss.Scene(
            [1.0, 1.0],
            np.diag([100.0, 1e4]),
            force=[0.0, -10.0],
            contacts=[ss.Contact(tangential=0, normal=1, friction=0.3)],
            dofs=["tangential", "perpendicular"],
        ),
    }
    for name, scene in scenes.items():
        ss.write_report(scene, folder / f"{name}.html", known=known(scene))
    return folder


@pytest.fixture
def opened(browser, files):
    """Return a function that opens a report; what went wrong in it fails the test at its end."""
    wrong, contexts = [], []

    def open_page(name="standard", **settings):
        context = browser.new_context(**{"viewport": DESKTOP} | settings)
        contexts.append(context)
        page = context.new_page()
        address = (files / f"{name}.html").as_uri()
        page.on("console", lambda message: wrong.append(f"console {message.type}: {message.text}"))
        page.on("pageerror", lambda error: wrong.append(f"error: {error}"))
        page.on(
            "request",
            lambda request: (
                None
                if request.url.startswith((address, "data:"))
                else wrong.append(f"request: {request.url}")
            ),
        )
        page.goto(address)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert wrong == []


def pixels(locator):
    return np.asarray(Image.open(io.BytesIO(locator.screenshot())).convert("L"), dtype=float)


def unfold(page):
    page.evaluate("for (const part of document.querySelectorAll('details')) part.open = true")


@pytest.mark.parametrize("name", ["standard", "ill-posed"])
@pytest.mark.parametrize("viewport", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_every_figure_is_there_and_not_blank(opened, name, viewport):
    page = opened(name, viewport=viewport, reduced_motion="reduce")
    unfold(page)
    drawings = page.locator("svg.plot, svg.motion")
    assert drawings.count() >= (28 if name == "standard" else 2)
    for drawing in drawings.all():
        label = drawing.get_attribute("aria-label")
        box = drawing.bounding_box()
        assert box["width"] > 150, label
        assert box["height"] > 30, label
        assert drawing.locator("path, circle, line").count() >= 3, label
        if viewport is DESKTOP:
            # A drawing has ink: lines that stand out, on some part of it.
            shade = pixels(drawing)
            assert np.ptp(shade) > 100, label
            assert np.mean(np.abs(shade - np.median(shade)) > 40) > 0.002, label
    for image in page.locator("svg.plot image").all():
        assert image.get_attribute("xlink:href").startswith("data:image/png;base64,")


@pytest.mark.parametrize("viewport", [DESKTOP, PHONE], ids=["desktop", "phone"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_fits_its_window_and_its_text_stands_out(opened, viewport, scheme):
    page = opened(viewport=viewport, color_scheme=scheme)
    assert page.evaluate("document.documentElement.scrollWidth") <= viewport["width"]
    ink, paper = (
        np.array([int(part) for part in re.findall(r"\d+", page.evaluate(code))[:3]])
        for code in (
            "getComputedStyle(document.body).color",
            "getComputedStyle(document.body).backgroundColor",
        )
    )
    assert np.abs(ink - paper).min() > 150
    assert (paper.mean() < 60) == (scheme == "dark")


def test_dense_curves_are_bright_on_dark_paper(opened):
    page = opened(color_scheme="dark", reduced_motion="reduce")
    picture = Image.open(io.BytesIO(page.locator("#cycle svg.plot").first.screenshot()))
    red, green, blue = np.moveaxis(np.asarray(picture.convert("RGB"), dtype=float), -1, 0)
    # The detached part, the only one that is yellow, is a curve of pixels; its name in the legend is a line.
    yellow = (red - blue > 80.0) & (green > 0.65 * red)
    assert yellow.sum() > 100
    assert (red[yellow] > 180.0).mean() > 0.5


def test_what_goes_on_beyond_its_frame_shows_it(opened):
    page = opened(viewport=PHONE, reduced_motion="reduce")
    for card in page.locator(".card").all():
        assert card.evaluate("card => card.scrollWidth > card.clientWidth")
        shade = pixels(card)
        # A shadow at the right, where it goes on; none at the left, where it begins.
        assert np.median(shade[:, -6]) < np.median(shade[:, 6]) - 40


def test_modes_move_until_they_are_paused_by_keyboard(opened):
    page = opened()
    place = "document.querySelector('svg.motion .point').getAttribute('transform')"
    before = page.evaluate(place)
    until(page, f"{place} !== {before!r}")
    page.locator("#motion").focus()
    page.keyboard.press("Space")
    assert page.locator("#motion").inner_text() == "Start the motion"
    still = page.evaluate(place)
    page.wait_for_timeout(200)
    assert page.evaluate(place) == still
    page.keyboard.press("Enter")
    assert page.locator("#motion").inner_text() == "Pause the motion"
    until(page, f"{place} !== {still!r}")


@pytest.mark.parametrize("name", ["standard", "ill-posed"])
def test_names_of_dofs_stand_beside_each_other(opened, name):
    page = opened(name, reduced_motion="reduce")
    for card in page.locator("svg.motion").all():
        boxes = [text.bounding_box() for text in card.locator("text").all()]
        assert len(boxes) >= 2
        for k, one in enumerate(boxes):
            for other in boxes[k + 1 :]:
                assert (
                    one["x"] + one["width"] <= other["x"]
                    or other["x"] + other["width"] <= one["x"]
                    or abs(one["y"] - other["y"]) > 5
                )


def test_nothing_moves_for_those_who_do_not_want_it(opened):
    page = opened(reduced_motion="reduce")
    place = "document.querySelector('svg.motion .point').getAttribute('transform')"
    before = page.evaluate(place)
    page.wait_for_timeout(200)
    assert page.evaluate(place) == before
    assert page.locator("#motion").inner_text() == "Start the motion"


def test_the_keyboard_reaches_everything_in_order(opened):
    page = opened(viewport=PHONE)
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    assert page.evaluate("document.activeElement.getBoundingClientRect().left") >= 0
    reached = []
    for _ in range(400):
        page.keyboard.press("Tab")
        place = page.evaluate(
            """() => { const e = document.activeElement;
            if (e === document.body) return null;
            const all = [...document.querySelectorAll('*')];
            return [all.indexOf(e), e.tagName, getComputedStyle(e).outlineStyle]; }"""
        )
        if place is None or (reached and place[0] <= reached[-1][0]):
            break
        reached.append(place)
    names = [name for _, name, _ in reached]
    # Pause, play, and one for each status.
    assert names.count("BUTTON") == 6
    assert names.count("INPUT") == 1
    assert names.count("SUMMARY") == page.locator("summary").count()
    assert names.count("A") == page.locator("nav a").count()
    # What scrolls sideways is reached as well, and everything shows where the focus is.
    assert names.count("DIV") == page.evaluate(
        """[...document.querySelectorAll('.wide')].filter(
            e => e.checkVisibility() && e.scrollWidth > e.clientWidth).length"""
    )
    assert names.count("DIV") > 5
    assert all(outline != "none" for _, _, outline in reached)


def test_links_lead_to_their_sections(opened):
    page = opened()
    links = page.locator("nav a")
    assert links.count() == page.locator("main > section").count()
    for link in links.all():
        link.focus()
        page.keyboard.press("Enter")
        target = link.get_attribute("href")
        assert page.evaluate("location.hash") == target
        assert page.locator(f"{target} h2").inner_text()


def test_it_prints_whole(opened, tmp_path):
    page = opened(reduced_motion="reduce")
    page.emulate_media(media="print")
    assert not page.locator("nav").is_visible()
    assert not page.locator("#motion").is_visible()
    # No heading, no summary and no caption stays behind on a page without what it is about.
    assert page.evaluate(
        """[...document.querySelectorAll("h2, h3, summary, caption")].every(
        (one) => getComputedStyle(one).breakAfter === "avoid")"""
    )
    paper = page.pdf(format="A4", path=tmp_path / "report.pdf", prefer_css_page_size=True)
    pages = len(re.findall(rb"/Type\s*/Page[^s]", paper))
    assert 8 <= pages <= 40
    assert len(paper) < 5e6
    # Nothing is wider than the paper: A4 less two margins of 14 mm at 96 pixels per inch.
    page.set_viewport_size({"width": int(182 / 25.4 * 96), "height": 1000})
    assert page.evaluate("document.documentElement.scrollWidth") <= int(182 / 25.4 * 96)


def test_the_slider_moves_every_panel(opened):
    page = opened(reduced_motion="reduce")
    assert page.locator("#move-still").is_hidden()
    panels = ("loci", "portraits", "ribbon", "energy")
    page.locator("#move").scroll_into_view_if_needed()
    values = page.evaluate("scene.values")
    assert len(values) == 31
    first = page.evaluate("scene.report.at()")
    assert values[first] == 1.5
    before = {name: pixels(page.locator(f"#move-{name}")) for name in panels}
    said = page.inner_text("#move-sentence")
    assert "limit cycle of 8.9085 ms" in said
    page.locator("#move-value").focus()
    for _ in range(6):
        page.keyboard.press("ArrowRight")
    assert page.evaluate("scene.report.at()") == first + 6
    assert page.inner_text("#move-shown").strip() == "2.1"
    assert page.inner_text("#move-sentence") != said
    for name in panels:
        after = pixels(page.locator(f"#move-{name}"))
        assert np.mean(np.abs(after - before[name]) > 40) > 0.002, name
    # What is shown is the limit cycle at that value.
    scene = ss.models.two_subsystems(friction=values[first + 6])
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
    period = ss.simulate(scene, 0.6, start).limit_cycle().period
    shown = page.evaluate("scene.pictures[scene.report.at()].cycle.period")
    assert shown == pytest.approx(period, rel=1e-9)


def test_one_time_in_history_ribbon_and_portrait(opened):
    page = opened(reduced_motion="reduce")
    parts = ("portraits", "structure", "way")

    def at(name, across):
        stage = page.locator(f"#move-{name} .stage")
        stage.scroll_into_view_if_needed()
        box = stage.bounding_box()
        page.mouse.click(box["x"] + across * box["width"], box["y"] + 0.5 * box["height"])
        return {part: pixels(page.locator(f"#move-{part} .stage").first) for part in parts}

    early, late = at("way", 0.55), at("way", 0.553)
    assert page.evaluate("scene.report.cursor().way")
    for part in parts:
        assert np.abs(early[part] - late[part]).max() > 60, part
    at("ribbon", 0.5)
    assert not page.evaluate("scene.report.cursor().way")
    period = page.evaluate("scene.pictures[scene.report.at()].cycle.period")
    assert 0.3 * period < page.evaluate("scene.report.cursor().time") < 0.7 * period
    page.locator("#move-play").click()
    time = page.evaluate("scene.report.cursor().time")
    page.wait_for_timeout(300)
    assert page.evaluate("scene.report.cursor().time") != time


def test_figures_to_touch_zoom_tell_values_and_hide_statuses(opened):
    page = opened(reduced_motion="reduce")
    stage = page.locator("#move-way .stage")
    stage.scroll_into_view_if_needed()
    box = stage.bounding_box()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    assert re.fullmatch(r"2\d\d\.\d+ ms 0: [+sd-] 1: [+sd-]", page.inner_text("#move-way .tip"))
    page.mouse.wheel(0, -300)
    page.wait_for_timeout(100)
    assert page.evaluate("scene.report.plots.way.zoomed.x[0]") > 0.0
    page.mouse.dblclick(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    assert page.evaluate("scene.report.plots.way.zoomed") is None
    portrait = page.locator("#move-portraits .stage").first
    page.evaluate("document.getElementById('move-value').dispatchEvent(new Event('input'))")
    before = pixels(portrait)
    page.get_by_role("button", name="sticking").click()
    assert page.get_by_role("button", name="sticking").get_attribute("aria-pressed") == "false"
    assert np.mean(np.abs(pixels(portrait) - before) > 40) > 0.001


def test_legends_of_figures_hide_what_they_name_and_figures_zoom(opened):
    page = opened(reduced_motion="reduce")
    # Loci, status, portraits and energy over time have legends whose every entry stands for something.
    entries = page.evaluate(
        """[...document.querySelectorAll("svg.plot")].map((plot) => [plot.getAttribute("aria-label"),
        [...plot.querySelectorAll("[data-entry]")].map((entry) =>
        plot.querySelectorAll(`[data-series="${entry.dataset.entry}"]`).length)])"""
    )
    told = {label.split()[0]: counts for label, counts in entries if counts}
    assert {"Growth", "Contact", "Tangential", "Stored"} <= set(told)
    assert all(min(counts) >= 1 for counts in told.values())
    loci = page.locator("svg.plot").first

    def inside():
        loci.scroll_into_view_if_needed()
        box = loci.bounding_box()
        return box["x"] + 0.6 * box["width"], box["y"] + 0.5 * box["height"]

    whole = loci.get_attribute("viewBox")
    page.mouse.move(*inside())
    page.mouse.wheel(0, -200)
    page.wait_for_timeout(100)
    # The page scrolls; a figure zooms once it was clicked.
    assert loci.get_attribute("viewBox") == whole
    before = pixels(loci)
    loci.get_by_text("unstable", exact=True).click()
    assert np.mean(np.abs(pixels(loci) - before) > 40) > 0.002
    loci.get_by_text("unstable", exact=True).click()
    place = inside()
    page.mouse.click(*place)
    page.mouse.wheel(0, -200)
    until(page, f"document.querySelector('svg.plot').getAttribute('viewBox') !== {whole!r}")
    near = [float(part) for part in loci.get_attribute("viewBox").split()]
    assert near[2] < 0.6 * float(whole.split()[2])
    page.mouse.down()
    page.mouse.move(place[0] + 60, place[1])
    page.mouse.up()
    assert float(loci.get_attribute("viewBox").split()[0]) < near[0]
    page.keyboard.press("Escape")
    assert loci.get_attribute("viewBox").split() == whole.split()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_figures_are_dark_in_the_dark_and_their_colours_stay(opened, scheme):
    page = opened(reduced_motion="reduce", color_scheme=scheme)
    status = page.locator("svg.plot[aria-label^='Contact status']").nth(1)
    status.scroll_into_view_if_needed()
    shade = np.asarray(Image.open(io.BytesIO(status.screenshot())).convert("RGB"), dtype=float)
    paper = shade[:4].mean()
    assert (paper < 60) == (scheme == "dark")
    for colour in ((0x44, 0x77, 0xAA), (0xCC, 0x33, 0x11), (0xDD, 0xAA, 0x33)):
        assert np.mean(np.abs(shade - colour).max(axis=2) < 3) > 0.001, colour
    # Lines of the axes, letters and marks of Hopf points stand out.
    ink = page.evaluate("getComputedStyle(document.body).color")
    for part in ("[data-entry] use", "text"):
        name = "stroke" if "use" in part else "fill"
        found = page.evaluate(f"getComputedStyle(document.querySelector('svg.plot {part}')).{name}")
        assert (found == ink) or scheme == "light"


def test_the_part_to_touch_is_dark_in_the_dark_and_not_on_paper(opened):
    page = opened(reduced_motion="reduce", color_scheme="dark")
    assert np.median(pixels(page.locator("#move-loci .stage"))) < 60
    page.emulate_media(media="print")
    assert not page.locator("#move").is_visible()
