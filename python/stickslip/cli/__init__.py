"""The command line: `stickslip`; one file per verb."""

from __future__ import annotations

import click

from stickslip.cli.completion import completion
from stickslip.cli.exits import Verbs
from stickslip.cli.verbs.boundary import boundary
from stickslip.cli.verbs.cycle import curve, cycle
from stickslip.cli.verbs.explore import explore, listen
from stickslip.cli.verbs.init import init, reduce
from stickslip.cli.verbs.modes import modes
from stickslip.cli.verbs.report import report
from stickslip.cli.verbs.simulate import simulate
from stickslip.cli.verbs.study import study
from stickslip.cli.verbs.sweep import sweep

EPILOG = """
\b
Exit codes:
  0    done
  1    done, and the answer is no: there is no limit cycle
  2    wrong usage, ill-posed input, or output that cannot be written
  3    no answer: a run could not go on (what it computed is written), or was too short to tell
  4    a defect of stickslip itself
  130  interrupted; the results so far are written
"""


@click.group(cls=Verbs, epilog=EPILOG, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="stickslip")
def main() -> None:
    """Friction-induced vibration: complex modes, stick-slip transients, limit cycles.

    \b
    Example:
      stickslip init brake.toml     write a commented scene file
      stickslip modes brake.toml    is steady sliding stable?
      stickslip cycle brake.toml    what happens when it is not?
    """


# Verb modules import what they compute with when they run: --help and completion stay quick.
VERBS = (
    init,
    modes,
    reduce,
    sweep,
    boundary,
    simulate,
    cycle,
    curve,
    listen,
    study,
    report,
    explore,
    completion,
)
for verb in VERBS:
    main.add_command(verb)
