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
import socket
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


def children(pid):
    """Return the processor time of all processes below one, s."""
    parents = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(file.parent.name)] = int(file.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
    found = {pid}
    while more := {child for child, parent in parents.items() if parent in found} - found:
        found |= more
    return sum(processor(child) for child in found - {pid} if Path(f"/proc/{child}").exists())


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


def told(name, updates, seconds, latency, moves, server, everything):
    low, high = np.percentile(latency, [50, 95])
    print(
        f"{name}: {updates / seconds:.1f} updates/s, latency {low:.0f} ms median, {high:.0f} ms at 95 %; "
        f"{1e3 * server / updates:.0f} ms of processor in the server and "
        f"{1e3 * (everything - server) / updates:.0f} ms in the browser each; {moves:.0f} movements/s",
        flush=True,
    )


def explorer(browser, seconds, minutes):
    command = [sys.executable, "-c", "from stickslip.cli import main; main()", "explore", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            page = browser.new_page(viewport={"width": 1400, "height": 1100})
            page.goto(server.stdout.readline().split()[0])
            page.wait_for_timeout(4000)
            place = page.locator("#map .stage").bounding_box()
            page.mouse.move(place["x"] + 0.6 * place["width"], place["y"] + 0.5 * place["height"])
            page.mouse.down()
            dragged(page, place, 2.0)
            page.evaluate("state.updates = 0; state.latency = []")
            before = np.array([processor(server.pid), children(os.getpid())])
            moves = dragged(page, place, seconds)
            updates, latency = page.evaluate("[state.updates, state.latency]")
            work = np.array([processor(server.pid), children(os.getpid())]) - before
            told("explorer, every panel", updates, seconds, latency, moves, *work)
            session = page.context.new_cdp_session(page)
            for minute in range(minutes):
                session.send("HeapProfiler.collectGarbage")
                heap = session.send("Runtime.getHeapUsage")["usedSize"] / 1e6
                updates = page.evaluate("state.updates")
                held = f"page {heap:.1f} MB, server {resident(server.pid):.0f} MB"
                print(f"  after {minute} min, {updates} updates: {held}", flush=True)
                dragged(page, place, 60.0)
            page.mouse.up()
            page.close()
        finally:
            server.terminate()


def bokeh(browser, seconds):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, Path(__file__).with_name("peers") / "bokeh_page.py", "--port", str(port)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
        try:
            server.stdout.readline()
            page = browser.new_page(viewport={"width": 1400, "height": 1100})
            page.goto(f"http://127.0.0.1:{port}/")
            page.wait_for_timeout(6000)
            place = {"x": 60, "y": 20, "width": 480, "height": 280}
            page.mouse.move(place["x"] + 0.6 * place["width"], place["y"] + 0.5 * place["height"])
            page.mouse.down()
            dragged(page, place, 2.0)
            page.evaluate("window.sent = []; window.got = []")
            before = np.array([processor(server.pid), children(os.getpid())])
            moves = dragged(page, place, seconds)
            sent, got = page.evaluate("[window.sent, window.got]")
            work = np.array([processor(server.pid), children(os.getpid())]) - before
            at = dict(sent)
            latency = [drawn - at[x] for x, drawn in got if x in at]
            told("Bokeh, map, loci and cycles", len(got), seconds, latency, moves, *work)
            page.close()
        finally:
            server.terminate()


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
            bokeh(browser, chosen.seconds)
        explorer(browser, chosen.seconds, chosen.minutes)
        browser.close()


if __name__ == "__main__":
    main()
