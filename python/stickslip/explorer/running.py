"""What a user calls: start the page of a model, wait for it, end it."""

from __future__ import annotations

import threading
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from stickslip.explorer.server import Server
from stickslip.explorer.wanted import Explored
from stickslip.faults import InputError
from stickslip.files.case import Case
from stickslip.modes.complex_modes import region_of
from stickslip.scene.checks import whole_number
from stickslip.scene.known import known_of
from stickslip.scene.parameters.family import Family

#: Height of the page inside a notebook, in CSS pixels.
HEIGHT = 900
PORTS = 65535


class Explorer:
    """A running page at the address `url`; `close` ends it, and so does leaving a ``with`` block."""

    def __init__(self, explored: Explored, port: int) -> None:
        self._server = Server(explored, port)
        self.url = self._server.url
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True)
        self._thread.start()

    def wait(self) -> None:
        """Wait until the page is closed by `close`, or Ctrl-C."""
        try:
            while self._thread.is_alive():
                self._thread.join(0.2)
        finally:
            self.close()

    def close(self) -> None:
        """End the page; a page still open in a browser says that its program has ended."""
        if self._thread.is_alive():
            self._server.shutdown()
            self._thread.join()
        self._server.server_close()

    def __enter__(self) -> Explorer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Explorer({self.url})" if self._thread.is_alive() else "Explorer(closed)"

    def _repr_html_(self) -> str:
        frame = '<iframe src="{}" width="100%" height="{}" style="border: 0"></iframe>'
        return Markup(frame).format(self.url, HEIGHT)


def explore(
    model: Any = None,
    *,
    port: int = 0,
    open_browser: bool = False,
    title: str | None = None,
    band: Sequence[float] | None = None,
) -> Explorer:
    """Show a model on a page on which its parameters are dragged and the motion follows.

    The page is served on 127.0.0.1 alone by this process and needs no network. It shows a map of stability
    over two parameters with a point to drag, root loci, the limit cycle of every contact, the transient that
    leads to it, the structure in motion, spectrum and energy.

    Parameters
    ----------
    model
        A `Scene`, a function from keywords to one, a `Case`, or the path of a scene file; None: the published
        model.
    port
        Port of the page, from 0 to 65535; 0: any free port.
    open_browser
        Whether to open the page in a browser window. A notebook shows the returned object as the page itself.
    title
        Name of the model on the page; None: the name of the file or function.
    band
        Lowest and highest frequency, Hz, of the modes that count, as for `complex_modes`; None: all. The page
        of a large scene shows loci and curves of a band alone.

    Returns
    -------
    Explorer
        The running page: ``.url``, ``.wait()``, ``.close()``.

    Raises
    ------
    InputError
        If `model` is no model, the port is outside its range, or `band` is ill-posed.
    OSError
        If the port is taken.
    """
    from stickslip.files.case import load_case
    from stickslip.scene import models

    given = models.two_subsystems if model is None else model
    name = Path(given).stem if isinstance(given, str | Path) else getattr(given, "__name__", "scene")
    if isinstance(given, str | Path):
        given = load_case(given)
    case = given if isinstance(given, Case) else Case(Family(given).given)
    if not case.scene.contacts:
        raise InputError("model: the scene has no contact, so nothing can be explored")
    if whole_number("port", port, 0) > PORTS:
        raise InputError(f"port: expected a number from 0 to {PORTS}, got {port}")
    ends = None
    if band is not None:
        region_of(band, (None, None))
        ends = float(band[0]), float(band[1])
    explored = Explored(case, known_of(case.scene), title or name, ends)
    found = Explorer(explored, port)
    if open_browser:
        webbrowser.open(found.url)
    return found
