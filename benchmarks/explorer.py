"""How well the explorer follows a dragged point, and whether its memory stays bounded.

A headless Chromium drags the point of the published model's map, with every panel shown and in motion.
Latency is the time from the last movement that a picture knows of to the end of its drawing. The server
computes in a process of its own, as `stickslip explore` does. The processor time of server and browser says
what a picture costs on a busy machine too.

    python benchmarks/explorer.py [--seconds 20] [--bokeh] [--minutes 10]
"""

import argparse
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

TICK = os.sysconf("SC_CLK_TCK")


def processor(pid):
    """Return the processor time of a process, s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def children(pid, apart):
    """Return the processor time of all processes below one, but for one of them, s."""
    parents = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(file.parent.name)] = int(file.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
    found = {pid}
    while more := {child for child, parent in parents.items() if parent in found} - found:
        found |= more
    return sum(processor(child) for child in found - {pid, apart} if Path(f"/proc/{child}").exists())


def resident(pid):
    """Return the memory of a process, MB."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def dragged(page, place, seconds):
    """Drag the pointer about a place for some time; return movements a second."""
    x, y, width, height = (place[name] for name in ("x", "y", "width", "height"))
    moves, begun = 0, time.perf_counter()
    while time.perf_counter() - begun < seconds:
        moves += 1
        page.mouse.move(
            x + width * (0.6 + 0.25 * np.sin(0.05 * moves)), y + height * (0.5 + 0.25 * np.cos(0.037 * moves))
        )
        time.sleep(0.008)
    return moves / (time.perf_counter() - begun)


def measured(browser, served, command, seconds, minutes=0):
    """Tell how a page of a server follows a dragged point, and what both hold after every minute."""
    name, place, reset, read = served
    with subprocess.Popen(
        [sys.executable, *command], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as server:
        try:
            page = browser.new_page(viewport={"width": 1400, "height": 1100})
            page.goto(server.stdout.readline().split()[0])
            page.wait_for_timeout(6000)
            box = page.evaluate(place)
            page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 0.5 * box["height"])
            page.mouse.down()
            dragged(page, box, 2.0)
            page.evaluate(reset)
            before = np.array([processor(server.pid), children(os.getpid(), server.pid)])
            moves = dragged(page, box, seconds)
            work = np.array([processor(server.pid), children(os.getpid(), server.pid)]) - before
            updates, latency = page.evaluate(read)
            low, high = np.percentile(latency, [50, 95])
            of_server, of_browser = 1e3 * work / updates
            print(
                f"{name}: {updates / seconds:.1f} updates/s, latency {low:.0f} ms median, {high:.0f} ms at "
                f"95 %; {of_server:.0f} ms of processor in the server and {of_browser:.0f} ms in browser and "
                f"driver each; {moves:.0f} movements/s",
                flush=True,
            )
            session = page.context.new_cdp_session(page)
            for minute in range(minutes + 1) if minutes else ():
                if minute:
                    dragged(page, box, 60.0)
                session.send("HeapProfiler.collectGarbage")
                heap = session.send("Runtime.getHeapUsage")["usedSize"] / 1e6
                held = f"page {heap:.1f} MB, server {resident(server.pid):.0f} MB"
                print(f"  after {minute} min, {page.evaluate(read)[0]} updates: {held}", flush=True)
            page.mouse.up()
            page.close()
        finally:
            server.terminate()


#: Name, JavaScript: where to drag, how to begin to count, and the updates and latencies, ms, counted since.
EXPLORER = (
    "explorer, every panel",
    "plots.map.stage.getBoundingClientRect().toJSON()",
    "state.updates = 0; state.latency = []",
    "[state.updates, state.latency]",
)
BOKEH = (
    "Bokeh, map, loci and cycles",
    "({ x: 60, y: 20, width: 480, height: 280 })",
    "window.sent = []; window.got = []",
    """(() => { const at = new Map(window.sent), known = window.got.filter(([x]) => at.has(x));
    return [window.got.length, known.map(([x, drawn]) => drawn - at.get(x))]; })()""",
)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=20.0, help="of dragging")
    parser.add_argument("--minutes", type=int, default=0, help="of dragging, in which memory is told")
    parser.add_argument("--bokeh", action="store_true", help="the same beside it on a page of Bokeh's server")
    chosen = parser.parse_args()
    chromium = shutil.which(os.environ.get("CHROMIUM", "chromium"))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--headless"])
        print(f"{os.cpu_count()} processors, {os.getloadavg()[0]:.1f} processes waiting for them")
        if chosen.bokeh:
            page = str(Path(__file__).with_name("peers") / "bokeh_page.py")
            measured(browser, BOKEH, [page], chosen.seconds)
        command = ["-c", "from stickslip.cli import main; main()", "explore", "--no-browser"]
        measured(browser, EXPLORER, command, chosen.seconds, chosen.minutes)
        browser.close()


if __name__ == "__main__":
    main()
