"""The page's server: on 127.0.0.1, for its own page alone, without a state that a message could change."""

from __future__ import annotations

import json
import select
import socket
import sys
import threading
import time
import traceback
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any

from stickslip.explorer.copies import drawn, heard, texts
from stickslip.explorer.curves import curves
from stickslip.explorer.maps import loci, verdicts
from stickslip.explorer.picture import json_text, picture
from stickslip.explorer.wanted import Explored, MalformedError, Wanted
from stickslip.faults import StickslipError

ADDRESS = "127.0.0.1"
#: What the page is made of; nothing else is read.
FILES = {
    "/": ("page.html", "text/html"),
    "/page.css": ("page.css", "text/css"),
    "/plots.js": ("plots.js", "text/javascript"),
    "/panels.js": ("panels.js", "text/javascript"),
    "/page.js": ("page.js", "text/javascript"),
}
#: Bytes of a message, and messages that may wait while one is computed.
LONGEST, WAITING = 1_000_000, 8
#: After this long without a word a connection is closed, s.
SILENCE = 60.0
#: Time in which a message that waits takes its turn, s.
TURN = 1e-3
#: The page loads from its own server alone, and only a page of this machine may frame it.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; media-src blob:; "
    "img-src 'self' data: blob:; frame-ancestors 'self' http://127.0.0.1:* http://localhost:*"
)

#: What a page may ask for: the bytes of a file and their type, or a JSON object, to which the server adds the
#: `seconds` that it took: they tell what a finer map will take.
ANSWERS: dict[str, Callable[[Wanted], Any]] = {
    "/motion": picture,
    "/loci": loci,
    "/map": verdicts,
    "/curves": curves,
    "/text": texts,
    "/figure": lambda wanted: ("application/pdf", drawn(wanted)),
    "/sound": lambda wanted: ("audio/wav", heard(wanted)),
}


class Server(ThreadingHTTPServer):
    """Answers a page; every message holds all it needs, so nothing of one is left for the next."""

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, explored: Explored, port: int) -> None:
        super().__init__((ADDRESS, port), Handler)
        self.explored = explored
        self.url = f"http://{ADDRESS}:{self.server_port}/"
        self.hosts = {f"{name}:{self.server_port}" for name in (ADDRESS, "localhost")}
        #: One message is computed at a time: the core may use every processor itself.
        self.computing = threading.Lock()
        self.room = threading.BoundedSemaphore(WAITING)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Let a connection that breaks off go without a word: its page was closed."""
        if not isinstance(sys.exception(), ConnectionError | TimeoutError):
            super().handle_error(request, client_address)


class Handler(BaseHTTPRequestHandler):
    """Answers one connection."""

    server: Server
    protocol_version = "HTTP/1.1"
    timeout = SILENCE
    server_version = "stickslip"
    sys_version = ""

    def do_GET(self) -> None:
        """Answer with a file of the page, or with what it is told once."""
        if not self._is_own():
            self._refuse(HTTPStatus.FORBIDDEN)
        elif self.path == "/scene":
            self._answer(self.server.explored.told)
        elif self.path in FILES:
            name, kind = FILES[self.path]
            text = files("stickslip.explorer").joinpath("page", name).read_text(encoding="utf-8")
            self._send(HTTPStatus.OK, f"{kind}; charset=utf-8", text.encode())
        else:
            self._refuse(HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """Compute what a message asks for."""
        try:
            length = int(self.headers.get("Content-Length", ""))
        except ValueError:
            length = -1
        if not 0 <= length <= LONGEST or "Transfer-Encoding" in self.headers:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
            return
        body = self.rfile.read(length)
        kind = self.headers.get("Content-Type", "")
        # A page from elsewhere cannot send this type without asking first, and is not answered then.
        origin = self.headers.get("Origin")
        if not self._is_own() or origin not in self._origins() or kind != "application/json":
            self._refuse(HTTPStatus.FORBIDDEN)
        elif self.path not in ANSWERS:
            self._refuse(HTTPStatus.NOT_FOUND)
        elif not self.server.room.acquire(blocking=False):
            self._refuse(HTTPStatus.SERVICE_UNAVAILABLE)
        else:
            try:
                self._compute(ANSWERS[self.path], body)
            finally:
                self.server.room.release()

    def _compute(self, what: Callable[[Wanted], Any], body: bytes) -> None:
        try:
            message = _parsed(body)
            with self.server.computing:
                begun = time.perf_counter()
                answer = what(Wanted(self.server.explored, message, self._pause))
        except StickslipError as error:
            self._answer({"error": str(error)})
            return
        except MalformedError as error:
            self._answer({"error": f"malformed message: {error}"}, HTTPStatus.BAD_REQUEST)
            return
        except ConnectionError:
            self.close_connection = True
            return
        except Exception as error:
            traceback.print_exc()
            told = f"This is a defect of stickslip, please report it: {type(error).__name__}: {error}"
            self._answer({"error": told}, HTTPStatus.INTERNAL_SERVER_ERROR)
            return
        if isinstance(answer, tuple):
            self._send(HTTPStatus.OK, *answer)
        else:
            took = {} if answer.get("error") else {"seconds": time.perf_counter() - begun}
            self._answer(answer | took)

    def _pause(self) -> None:
        """Let messages that wait be computed first, unless the page has given this one up."""
        ready, _, _ = select.select([self.connection], [], [], 0.0)
        if ready and not self.connection.recv(1, socket.MSG_PEEK):
            raise ConnectionAbortedError("the page waits no longer")
        self.server.computing.release()
        try:
            time.sleep(TURN)
        finally:
            self.server.computing.acquire()

    def _is_own(self) -> bool:
        # A name that resolves to this machine for the moment is not one of its own.
        return self.headers.get("Host", "") in self.server.hosts

    def _origins(self) -> set[str]:
        return {f"http://{host}" for host in self.server.hosts}

    def _refuse(self, status: HTTPStatus) -> None:
        self.close_connection = True
        self._answer({"error": status.phrase}, status)

    def _answer(self, answer: Any, status: HTTPStatus = HTTPStatus.OK) -> None:
        self._send(status, "application/json", json_text(answer).encode())

    def _send(self, status: HTTPStatus, kind: str, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Content-Security-Policy", POLICY)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Keep quiet: the page tells its user what matters."""


def _parsed(body: bytes) -> Any:
    try:
        return json.loads(body, parse_constant=_refused)
    # Python reads no integer of more than some thousand digits.
    except (ValueError, RecursionError) as error:
        raise MalformedError(str(error)) from None


def _refused(constant: str) -> float:
    raise MalformedError(f"{constant} is no number")
