"""Film the explorer: a headless Chromium drags the point of the published model, Pillow writes a GIF.

python benchmarks/explorer_film.py docs/explorer.gif
"""

import argparse
import io
import os
import shutil
import time
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

import stickslip as ss

#: Pictures, ms that each is shown, pixels across, colours.
PICTURES, SHOWN, WIDTH, SHADES = 44, 120, 820, 128
#: Friction and damping (s) on the way of the point, from where the film ends, too.
WAY = ((1.5, 1e-4), (0.55, 1.2e-4), (0.9, 1.7e-4), (1.5, 2.2e-4), (2.4, 1.8e-4), (1.9, 5e-5), (1.5, 1e-4))


def drawn(page):
    end = time.monotonic() + 60.0
    while not page.evaluate("!!(state.motion && state.loci && state.map)") or page.evaluate(
        "Object.values(lanes).some((lane) => lane.busy)"
    ):
        if time.monotonic() > end:
            raise SystemExit("the page does not answer")
        page.wait_for_timeout(20)


def filmed(page):
    places = np.linspace(0.0, len(WAY) - 1.0, PICTURES, endpoint=False)
    way = np.stack([np.interp(places, np.arange(len(WAY)), axis) for axis in np.transpose(WAY)], axis=1)
    page.mouse.move(*page.evaluate(PLACE, [1.5, 1e-4]))
    page.mouse.down()
    for k, point in enumerate(way):
        page.mouse.move(*page.evaluate(PLACE, point.tolist()))
        drawn(page)
        # One time in all panels, which passes from picture to picture.
        page.evaluate(
            """(part) => { const s = state.motion[state.cursor.series];
            if (s) { state.cursor.time = s.begin + part * (s.end - s.begin); drawCursor(); } }""",
            k / 12 % 1.0,
        )
        yield Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    page.mouse.up()


PLACE = """([x, y]) => { const place = plots.map.stage.getBoundingClientRect();
    return [place.left + plots.map.X(x), place.top + plots.map.Y(y)]; }"""


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("film", type=Path)
    film = parser.parse_args().film
    chromium = shutil.which(os.environ.get("CHROMIUM", "chromium"))
    with ss.explore() as served, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--headless"])
        size = {"width": 1340, "height": 1400}
        page = browser.new_page(viewport=size, reduced_motion="reduce")
        page.goto(served.url)
        drawn(page)
        pictures = [
            picture.resize((WIDTH, WIDTH * size["height"] // size["width"]), Image.Resampling.LANCZOS)
            for picture in filmed(page)
        ]
        browser.close()
    # One palette for all: colours do not flicker, and what stays the same takes no room.
    some = Image.fromarray(np.concatenate([np.asarray(picture) for picture in pictures[::6]]))
    palette = some.quantize(SHADES, dither=Image.Dither.NONE)
    quantized = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    quantized[0].save(
        film, save_all=True, append_images=quantized[1:], duration=SHOWN, loop=0, optimize=True, disposal=1
    )
    print(f"wrote {film}: {len(quantized)} pictures, {film.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
