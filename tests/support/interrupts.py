"""Ctrl-C that a process sends to itself, measured in processor time: a busy machine changes neither.

Used by the programs that tests start, and by these tests to start them.
"""

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import stickslip


class Interrupt:
    """Ctrl-C once this process has used some processor time from now on, s."""

    def __init__(self, after):
        # The package imports its modules at first use: an interrupt in an import would have nothing to keep.
        for name in stickslip.__all__:
            getattr(stickslip, name)
        self._due = time.process_time() + after
        self._sent = None
        threading.Thread(target=self._send, daemon=True).start()

    def _send(self):
        while time.process_time() < self._due:
            time.sleep(0.001)
        self._sent = time.process_time()
        os.kill(os.getpid(), signal.SIGINT)

    def unheard(self):
        """Return the processor time since it was sent, s."""
        return time.process_time() - self._sent


def printed(program, *arguments, timeout, folders=()):
    """Return what a program prints that must end well; it finds this file, and what is in some folders."""
    path = os.pathsep.join([*folders, os.path.dirname(__file__), os.environ.get("PYTHONPATH", "")])
    process = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program), *arguments],
        stdout=subprocess.PIPE,
        text=True,
        timeout=timeout,
        env={**os.environ, "PYTHONPATH": path},
    )
    assert process.returncode == 0
    return process.stdout
