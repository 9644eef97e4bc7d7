"""An installed package, tried out: the compiled core, its data and the command line."""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import stickslip as ss

folder = Path(ss.__file__).parent
assert "site-packages" in folder.parts, f"not an installed package: {folder}"
assert (folder / "py.typed").exists()
assert (folder / "_core.pyi").exists()

scene = ss.models.two_subsystems()
run = ss.simulate(scene, 0.6, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3}))
assert len(run.events) == 312
assert abs(run.limit_cycle().period - 8.908492605779e-3) < 1e-14

command = shutil.which("stickslip", path=str(Path(sys.executable).parent))
assert command, "no command stickslip beside the interpreter"
with tempfile.TemporaryDirectory() as place:
    ss.save(scene, Path(place) / "two.toml")
    for arguments in (["--version"], ["modes", "two.toml"], ["report", "two.toml"]):
        subprocess.run([command, *arguments], cwd=place, check=True, stdout=subprocess.DEVNULL)
    assert (Path(place) / "two.html").stat().st_size > 100_000
print(f"stickslip {ss.__version__} works from {folder}")
