"""Ctrl-C stops one long call that follows the eigenvalues of a large scene."""

import os
import sys

import pytest

import interrupts

#: A mesh of 420 dofs: seconds to minutes, a tenth of a second or two for every eigenproblem.
FOLLOWING = """
    import sys
    import numpy as np
    import stickslip as ss
    from interrupts import Interrupt
    from quad_block import quad_block

    scene = quad_block(20, 10, 2)
    ss.complex_modes(scene)
    call = eval(sys.argv[1])
    interrupt = Interrupt(after=2.0)
    try:
        call()
    except KeyboardInterrupt:
        print(interrupt.unheard())
"""


@pytest.mark.process
@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT to one process")
@pytest.mark.parametrize(
    "call",
    [
        'lambda: ss.sweep(scene, {"friction": np.linspace(0.0, 0.6, 10001)}, modes=24)',
        'lambda: ss.sweep(scene, {"friction": np.linspace(0.0, 0.6, 10001)}, progress=False)',
        'lambda: ss.critical_points(scene, {"friction": (0.0, 0.6)})',
        'lambda: ss.critical_points(scene, {"friction": (0.0, 0.6)}, kinds=("hopf",))',
    ],
    ids=["leading modes", "all modes", "critical points", "Hopf points"],
)
def test_ctrl_c_is_heard_while_eigenvalues_are_followed(call):
    unheard = interrupts.printed(FOLLOWING, call, timeout=300)
    # The promise is about a second: what every thread has begun, here in the processor time of all together.
    assert float(unheard) <= 1.5 * os.cpu_count()
