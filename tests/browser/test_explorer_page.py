"""The explorer in a browser, driven as a user would: drag, sliders, zoom, listen, copy."""

import io

import numpy as np
import pytest
from PIL import Image

import stickslip as ss
from meshed import block
from waiting import until

PANELS = ("map", "loci", "portraits", "structure", "ribbon", "way", "lines", "energy")


@pytest.fixture(scope="module")
def served():
    with ss.explore() as served:
        yield served


@pytest.fixture
def opened(browser, served):
    """Return a function that opens the page; what went wrong in it fails the test at its end."""
    wrong, contexts = [], []

    def open_page(url=served.url, **settings):
        told = {"viewport": {"width": 1400, "height": 1100}, "reduced_motion": "reduce"} | settings
        context = browser.new_context(permissions=["clipboard-read", "clipboard-write"], **told)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: wrong.append(f"console {message.type}: {message.text}"))
        page.on("pageerror", lambda error: wrong.append(f"error: {error}"))
        own = (url, f"blob:{url}", "data:")
        page.on(
            "request",
            lambda request: None if request.url.startswith(own) else wrong.append(f"request: {request.url}"),
        )
        page.goto(url)
        settled(page)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert wrong == []


def settled(page):
    """Wait until every question is answered and drawn."""
    until(
        page,
        "!!(state.motion && state.loci && (state.map || state.curves)) "
        "&& Object.values(lanes).every((lane) => !lane.busy)",
    )


def middle(page, panel, across=0.5, up=0.5):
    box = page.locator(f"#{panel} .stage").first.bounding_box()
    return box["x"] + across * box["width"], box["y"] + (1 - up) * box["height"]


def shade(locator):
    return np.asarray(Image.open(io.BytesIO(locator.screenshot())).convert("RGB"), dtype=float)


def shown_is_true(page):
    """Check that what is shown is the limit cycle of the parameters shown."""
    values = page.evaluate("state.motion.values")
    assert values == page.evaluate("state.values")
    scene = ss.models.two_subsystems(
        friction=[values["friction_0"], values["friction_1"]],
        slider_speed=[values["slider_speed_0"], values["slider_speed_1"]],
        damping=values["damping"],
    )
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
    try:
        cycle = ss.simulate(scene, page.evaluate("state.motion.way.end"), start).limit_cycle(3.0)
    except ss.NotPeriodicError:
        assert page.evaluate("state.motion.cycle") is None
        return
    assert page.evaluate("state.motion.cycle.combinations") == list(cycle.combinations)
    assert page.evaluate("state.motion.cycle.period") == pytest.approx(cycle.period, rel=1e-9)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_panel_has_ink_of_its_own(opened, scheme):
    page = opened(color_scheme=scheme)
    for panel in PANELS:
        for stage in page.locator(f"#{panel} .stage").all():
            box = stage.bounding_box()
            assert box["width"] > 150, panel
            pixels = shade(stage)
            paper = np.median(pixels.reshape(-1, 3), axis=0) if panel != "map" else 0.0
            assert np.ptp(pixels) > 100, panel
            assert np.mean(np.abs(pixels - paper).max(axis=2) > 40) > 0.005, panel
    # Statuses have their colours in the ribbon, stable and unstable theirs in the map.
    ribbon = shade(page.locator("#ribbon .stage")).reshape(-1, 3)
    for colour in ((0x44, 0x77, 0xAA), (0xCC, 0x33, 0x11), (0xDD, 0xAA, 0x33)):
        assert np.mean(np.abs(ribbon - colour).max(axis=1) < 3) > 0.01, colour
    stability = shade(page.locator("#map .stage")).astype(float)
    redder = stability[..., 0] - stability[..., 2]
    assert np.mean(redder > 30) > 0.3
    assert np.mean(redder < -15) > 0.1


def test_the_point_is_dragged_and_the_motion_follows(opened):
    page = opened()
    shown_is_true(page)
    before, asked = page.evaluate("[state.motion.cycle.period, state.updates]")
    page.mouse.move(*middle(page, "map"))
    page.mouse.down()
    for k in range(30):
        page.mouse.move(*middle(page, "map", 0.5 + 0.01 * k, 0.5 - 0.008 * k))
        page.wait_for_timeout(10)
    # It follows while the point is held, not only when it is let go.
    until(page, f"state.dragging && state.updates > {asked} + 3")
    page.mouse.up()
    settled(page)
    shown_is_true(page)
    assert page.evaluate("state.motion.cycle.period") != before
    assert page.evaluate("state.values.friction_0") > 1.6
    assert "limit cycle" in page.inner_text("#sentence")


def test_sliders_numbers_and_keys_move_the_point(opened):
    page = opened()
    slider = page.locator('.knob[data-name="friction"] input[type=range]')
    slider.focus()
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    settled(page)
    shown_is_true(page)
    moved = page.evaluate("state.values.friction_0")
    assert moved > 1.5
    number = page.locator('.knob[data-name="damping"] input[type=number]')
    number.fill("0.00012")
    number.press("Enter")
    settled(page)
    assert page.evaluate("state.values.damping") == 0.00012
    shown_is_true(page)
    page.locator("#map .stage").focus()
    page.keyboard.press("ArrowLeft")
    settled(page)
    assert page.evaluate("state.values.friction_0") == pytest.approx(moved - 0.03)
    page.locator("#reset").click()
    settled(page)
    assert page.evaluate("state.values.friction_0") == 1.5
    # One contact alone, from the slider of all.
    page.get_by_text("friction, each", exact=True).click()
    page.locator('.knob[data-name="friction_1"] input[type=number]').fill("1.2")
    settled(page)
    assert page.evaluate("[state.values.friction_0, state.values.friction_1]") == [1.5, 1.2]
    page.locator("#filter").fill("wall")
    assert page.locator(".knob:visible").count() == 1


def test_axes_zoom_move_and_come_back(opened):
    page = opened()
    whole = page.evaluate("plots.loci.range()")
    page.mouse.move(*middle(page, "loci", 0.7, 0.5))
    page.mouse.wheel(0, -480)
    until(page, "plots.loci.zoomed !== null")
    near = page.evaluate("plots.loci.range()")
    assert near["x"][1] - near["x"][0] < 0.5 * (whole["x"][1] - whole["x"][0])
    page.mouse.down()
    page.mouse.move(*middle(page, "loci", 0.5, 0.5))
    page.mouse.up()
    assert page.evaluate("plots.loci.range().x[0]") > near["x"][0]
    page.mouse.dblclick(*middle(page, "loci", 0.5, 0.5))
    assert page.evaluate("plots.loci.range()") == whole
    page.mouse.move(*middle(page, "loci", 0.5, 0.5))
    assert "Hz" in page.locator("#loci .tip").inner_text()
    page.mouse.move(*middle(page, "map", 0.8, 0.5))
    assert "growth rate" in page.locator("#map .tip").inner_text()


def test_an_answer_that_takes_long_is_told_to_be_on_its_way(opened):
    page = opened()
    pace = page.locator("#pace")
    assert pace.inner_text().startswith("computed in ")
    page.evaluate(
        """() => {
          const fetched = window.fetch;
          window.fetch = (...given) => new Promise((done) => {
            window.answered = () => done(fetched(...given));
          });
          lanes.motion.last = "";
          lanes.motion.ask();
        }"""
    )
    until(page, 'by("pace").textContent === "computing ..."')
    page.evaluate("window.answered()")
    until(page, 'by("pace").textContent.startsWith("computed in ")')


def test_axes_have_units_and_ticks_that_suit_what_they_show(opened):
    page = opened()
    texts = page.evaluate(
        """() => {
          const told = [], write = CanvasRenderingContext2D.prototype.fillText;
          CanvasRenderingContext2D.prototype.fillText = function (text, ...place) {
            told.push(text);
            write.call(this, text, ...place);
          };
          const texts = (draw) => { told.length = 0; draw(); return [...told]; };
          const { way } = state.motion;
          const far = (times) => ({ ...way, begin: way.begin * times, end: way.end * times,
            time: way.time.map((t) => t * times) });
          const work = (most) => [{ name: "contact 0", parts: { s: most, d: -0.3 * most } }];
          const lines = (most) => ({ exact: true, frequency: [1, 2, 3],
            amplitude: [1, 0.1, 0.01].map((a) => a * most) });
          const portrait = plots.portraits[0];
          const found = {
            long: texts(() => drawWay(plots.way, far(1e3), 0)),
            brief: texts(() => drawRibbon(plots.ribbon, far(1e-6))),
            large: texts(() => drawEnergy(plots.energy, work(7.5e3))),
            small: texts(() => drawEnergy(plots.energy, work(2e-5))),
            told: worksOf(work(7.5e3)[0]),
            metres: texts(() => drawLines(plots.lines, lines(2e6))),
          };
          portrait.zoomed = { x: [-57.5504, -57.5496], y: [0, 1] };
          found.close = texts(() => drawPortrait(portrait, 0, state.motion.motion, null));
          portrait.zoomed = null;
          plots.lines.zoomed = { x: [0, 1], y: [0.31, 0.34] };
          found.narrow = texts(() => drawLines(plots.lines, lines(2e6)));
          plots.lines.zoomed = null;
          return found;
        }"""
    )
    assert "time, s" in texts["long"]
    assert "time, ms" not in texts["long"]
    assert "time, µs" in texts["brief"]
    assert {"J", "0", "6"} <= set(texts["large"])
    assert {"nJ", "0", "10", "20"} <= set(texts["small"])
    assert texts["told"] == "contact 0: s 7.5, d \N{MINUS SIGN}2.25 J"
    assert {"amplitude, m", "1e0", "1e\N{MINUS SIGN}2"} <= set(texts["metres"])
    for name in ("close", "narrow"):
        ticks = [text for text in texts[name] if not set(text) & set(" ,")]
        assert len(ticks) > 4
        assert name == "narrow" or len(set(ticks[:3])) == 3
    assert any("from \N{MINUS SIGN}57.550" in text for text in texts["close"])
    assert len(set(texts["narrow"])) == len(texts["narrow"])


def test_other_parameters_make_another_map(opened):
    page = opened()
    page.locator("#y").select_option("inclination_0")
    settled(page)
    assert page.evaluate("state.map.y.name") == "inclination_0"
    # The angle decides on stability: rows differ.
    rows = page.evaluate(
        """[0, state.map.rows - 1].map((j) => Array.from(
            state.map.growth.slice(j * state.map.columns, (j + 1) * state.map.columns)))"""
    )
    assert rows[0] != rows[1]
    page.locator("#y").select_option("friction")
    assert page.locator("#y").input_value() == "inclination_0"
    assert "different parameters" in page.inner_text("#note")


def test_curves_are_drawn_sharply_on_the_map(opened):
    page = opened()
    assert page.inner_text("#curves") == "2 Hopf curves; counts of modes agree at 64 x 64 places."
    page.locator("#y").select_option("vertical_stiffness_0")
    settled(page)
    # The curve is ink where a point of it stands, at any zoom, and its double Hopf point is named.
    texts = page.evaluate(
        """() => {
          const told = [], write = CanvasRenderingContext2D.prototype.fillText;
          CanvasRenderingContext2D.prototype.fillText = function (text, ...place) {
            told.push(text);
            write.call(this, text, ...place);
          };
          plots.map.drawn();
          CanvasRenderingContext2D.prototype.fillText = write;
          return told;
        }"""
    )
    assert "double Hopf" in texts
    show = """(near) => {
      const { x, y } = state.curves.pieces.find(({ look }) => look === 2), plot = plots.map;
      const k = Math.floor(0.3 * x.length), around = (v, width) => [v - 2 * width, v + width];
      plot.zoomed = near ? { x: around(x[k], 0.01), y: around(y[k], 1e4) } : null;
      plot.drawn();
      return [plot.X(x[k]), plot.Y(y[k])].map(Math.round);
    }"""
    for near in (False, True):
        across, down = page.evaluate(show, near)
        pixels = shade(page.locator("#map .stage"))[down - 1 : down + 2, across - 1 : across + 2]
        assert pixels.min() < 60
    page.evaluate("plots.map.zoomed = null; plots.map.drawn()")
    place = page.evaluate(
        """() => {
          const point = state.curves.points.find(({ name }) => name);
          return [plots.map.X(point.x), plots.map.Y(point.y)];
        }"""
    )
    box = page.locator("#map .stage").bounding_box()
    page.mouse.move(box["x"] + place[0] + 2, box["y"] + place[1] + 2)
    assert page.locator("#map .tip").inner_text().startswith("double Hopf at 2.2016, 156688: 112.905 Hz")
    # A drag over the map leaves them; another number makes others, once it rests.
    key = page.evaluate("state.curves.key")
    page.mouse.move(*middle(page, "map"))
    page.mouse.down()
    page.mouse.move(*middle(page, "map", 0.6, 0.6))
    assert page.evaluate("curvesNow() !== null")
    page.mouse.up()
    settled(page)
    assert page.evaluate("state.curves.key") == key
    page.locator('.knob[data-name="damping"] input[type=number]').fill("0")
    settled(page)
    assert page.evaluate("state.curves.key") != key
    assert page.inner_text("#curves").startswith("No curves: model: a mode neither grows nor decays")


def test_curves_are_drawn_while_another_number_is_dragged(opened):
    page = opened()
    assert page.evaluate("state.curves.lines") == 16
    page.evaluate(
        """() => {
          window.drawn = [];
          const draw = drawMap;
          drawMap = (...given) => { window.drawn.push(given.at(-1)?.lines ?? null); draw(...given); };
        }"""
    )
    knob = page.locator('.knob[data-name="vertical_stiffness_0"] input[type=range]').bounding_box()
    across = knob["y"] + 0.5 * knob["height"]
    page.mouse.move(knob["x"] + 0.5 * knob["width"], across)
    page.mouse.down()
    for part in (0.52, 0.54, 0.56):
        page.mouse.move(knob["x"] + part * knob["width"], across)
        until(page, "!lanes.curves.busy && !lanes.map.busy")
        assert page.evaluate("state.dragging && curvesNow()?.lines") == 4
        assert page.evaluate("window.drawn.at(-1)") == 4
        # They are those of the number as it stands.
        assert page.evaluate("JSON.parse(state.curves.key).values.vertical_stiffness_0") == page.evaluate(
            "state.values.vertical_stiffness_0"
        )
    assert page.inner_text("#curves").endswith("counts of modes agree at 16 x 16 places.")
    few = page.evaluate("state.curves.pieces.map(({ x }) => [x[0], x.at(-1)])")
    page.mouse.up()
    settled(page)
    assert page.evaluate("curvesNow()?.lines") == 16
    assert page.inner_text("#curves").endswith("counts of modes agree at 64 x 64 places.")
    many = page.evaluate("state.curves.pieces.map(({ x }) => [x[0], x.at(-1)])")
    assert np.sort(few, axis=None) == pytest.approx(np.sort(many, axis=None), abs=1e-6)


def test_the_map_of_a_band_comes_with_its_curves(opened):
    with ss.explore(band=(150.0, 250.0)) as banded:
        page = opened(banded.url)
        assert page.evaluate("state.map") is None
        assert page.inner_text("#curves") == "1 Hopf curve; counts of modes agree at 64 x 64 places."
        assert page.evaluate("[mapNow().columns, mapNow().rows]") == [64, 64]
        # Its cells are coloured up to the borders: the image is as wide as the plot.
        pixels = shade(page.locator("#map .stage"))
        box = page.evaluate("plots.map.box")
        inside = pixels[int(box["y"] + 0.5 * box["h"]), int(box["x"]) + 2 : int(box["x"] + box["w"]) - 2]
        assert np.count_nonzero(inside.min(axis=1) < 250) > 0.9 * len(inside)
        page.mouse.move(*middle(page, "map"))
        assert "growth rate" in page.locator("#map .tip").inner_text()
        # Where another number makes it another map, there is none until its curves have come.
        page.evaluate("state.values.wall_stiffness *= 1.5")
        assert page.evaluate("mapNow()") is None


def test_a_question_for_curves_that_is_another_one_by_now_is_given_up(opened):
    page = opened()
    page.evaluate(
        """() => {
          const fetched = window.fetch;
          window.gone = 0;
          window.fetch = (path, given) => new Promise((done, failed) => {
            given.signal?.addEventListener("abort", () => { window.gone += 1; });
            setTimeout(() => fetched(path, given).then(done, failed), path === "curves" ? 300 : 0);
          });
        }"""
    )
    number = page.locator('.knob[data-name="wall_stiffness"] input[type=number]')
    number.fill("1900000")
    until(page, "lanes.curves.busy")
    number.fill("2000000")
    until(page, "window.gone === 1")
    settled(page)
    assert page.evaluate("curvesNow().whole")
    assert page.evaluate("JSON.parse(state.curves.key).values.wall_stiffness") == 2e6
    assert page.inner_text("#note") == ""


def test_one_time_cursor_in_every_panel(opened):
    page = opened()
    positions = []
    for panel, series in (("ribbon", "motion"), ("way", "way"), ("ribbon", "motion")):
        page.mouse.click(*middle(page, panel, 0.4, 0.6))
        cursor = page.evaluate("state.cursor")
        assert cursor["series"] == series
        positions.append(
            [shade(page.locator(f"#{name} .stage").first) for name in ("structure", "portraits", panel)]
        )
    page.mouse.click(*middle(page, "ribbon", 0.8, 0.6))
    later = [shade(page.locator(f"#{name} .stage").first) for name in ("structure", "portraits", "ribbon")]
    for one, other in zip(positions[2], later, strict=True):
        assert np.abs(one - other).max() > 100
    page.locator("#play").click()
    time_before = page.evaluate("state.cursor.time")
    until(page, f"state.cursor.time !== {time_before}")
    page.locator("#play").click()
    assert page.inner_text("#play") == "Play"


def test_starts_are_chosen(opened):
    page = opened()
    page.locator("#start").select_option("kick")
    settled(page)
    assert page.locator("#kick").is_visible()
    page.locator("#kick").fill("0.02")
    page.locator("#kick").press("Enter")
    settled(page)
    fast = page.evaluate("state.motion.way.position[0]")
    assert np.isfinite(fast)
    page.locator("#start").select_option("on")
    settled(page)
    assert page.evaluate("state.motion.cycle.period") == pytest.approx(8.908492605779e-3, rel=1e-9)
    page.locator("#dof").select_option("4")
    settled(page)
    assert page.evaluate("state.dof") == 4


def test_sound_is_heard_and_texts_are_copied(opened):
    page = opened()
    page.locator("#listen").click()
    until(page, "by('audio').duration > 0")
    assert page.evaluate("by('audio').duration") == pytest.approx(3.0, abs=0.01)
    for name, begins in (("toml", "# A scene for stickslip"), ("python", "import stickslip as ss")):
        page.locator(f"#{name}").click()
        until(page, f"by('text').textContent.startsWith({begins!r})")
        until(page, "by('copied').querySelector('summary').textContent === 'Copied'")
        assert page.evaluate("navigator.clipboard.readText()").startswith(begins)
    with page.expect_download() as download:
        page.locator("#figure").click()
    with open(download.value.path(), "rb") as file:
        assert file.read(5) == b"%PDF-"


def test_a_hundred_random_drags_leave_no_stale_picture(opened):
    page = opened()
    random = np.random.default_rng(7)
    for drag in range(100):
        page.mouse.move(*middle(page, "map", *random.uniform(0.2, 0.95, 2)))
        page.mouse.down()
        for _ in range(3):
            page.mouse.move(*middle(page, "map", *random.uniform(0.2, 0.95, 2)))
        page.mouse.up()
        if drag % 25 == 24:
            settled(page)
            shown_is_true(page)
    assert page.evaluate("state.latency.length") <= 2000


def test_memory_does_not_grow_with_dragging(opened):
    page = opened()
    session = page.context.new_cdp_session(page)

    def held():
        session.send("HeapProfiler.collectGarbage")
        return session.send("Runtime.getHeapUsage")["usedSize"]

    def drag(times):
        page.mouse.move(*middle(page, "map"))
        page.mouse.down()
        for k in range(times):
            page.mouse.move(*middle(page, "map", 0.6 + 0.2 * np.sin(k), 0.5 + 0.2 * np.cos(k)))
        page.mouse.up()
        settled(page)

    drag(40)
    before = held()
    drag(150)
    # An answer is some 0.3 MB: were they kept, it would be tens.
    assert held() - before < 3e6


def belt():
    """Return an elastic block on a belt: a scene with a mesh."""
    body = block(8, 4)
    pairs = ss.fe.contact_pairs(body.surface("low"), None, velocity=(1.0, 0.0), friction=0.3, gap=-1e-6)
    return ss.fe.assemble(body, pairs).replace(impact_friction=True)


def slow_motion(route):
    """Answer as the program does, but as a machine that needs a second for every motion."""
    answer = route.fetch()
    route.fulfill(response=answer, json=answer.json() | {"seconds": 1.0})


def test_a_large_scene_is_drawn_on_its_mesh_and_computed_on_release(opened):
    with ss.explore(belt()) as served:
        page = opened(served.url)
        assert page.evaluate("scene.faces.length") == 32
        structure = shade(page.locator("#structure .stage"))
        assert np.ptp(structure) > 80
        page.locator("#way .stage").click()
        assert np.abs(shade(page.locator("#structure .stage")) - structure).max() > 80
        page.locator("#map .stage").scroll_into_view_if_needed()
        page.route("**/motion", slow_motion)
        page.mouse.move(*middle(page, "map"))
        page.mouse.down()
        settled(page)
        page.mouse.move(*middle(page, "map", 0.6))
        # Two answers tell that it is too slow; nothing is asked from then on.
        until(page, "lanes.motion.slow && Object.values(lanes).every((lane) => !lane.busy)")
        updates = page.evaluate("state.updates")
        for k in range(5):
            page.mouse.move(*middle(page, "map", 0.6 + 0.02 * k, 0.6))
        page.wait_for_timeout(300)
        assert page.evaluate("state.updates") == updates
        assert "too large to follow live" in page.inner_text("#note")
        page.mouse.up()
        until(page, f"state.updates > {updates}")
        settled(page)
        assert page.evaluate("state.motion.values") == page.evaluate("state.values")


@pytest.mark.parametrize("width", [375, 800])
def test_it_fits_a_narrow_window(opened, width):
    page = opened(viewport={"width": width, "height": 740})
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for panel in PANELS:
        assert page.locator(f"#{panel} .stage").first.bounding_box()["width"] > 150
    # The sliders stay in sight beside the last figure too.
    page.locator("#energy").scroll_into_view_if_needed()
    sliders = page.locator("aside").bounding_box()
    assert sliders["y"] >= 0
    assert sliders["y"] + sliders["height"] < 0.5 * 740


def test_slip_in_a_plane_is_drawn(opened):
    """Its status has a line style and a hatching of its own, and the page shows no error."""
    scene = ss.models.mass_on_belt_in_plane(static_friction=0.6)
    case = ss.Case(scene, {"velocity": {"x": 0.5, "y": 0.3}}, {"duration": 5.0})
    with ss.explore(case) as served:
        page = opened(served.url)
        assert [one["letter"] for one in page.evaluate("scene.statuses")] == ["+", "-", "s", "d", "o"]
        assert shade(page.locator("#portraits .stage").first).std() > 1.0
