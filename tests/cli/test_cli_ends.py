"""How commands end: exit codes, output that cannot be written, encodings, and examples that shells take."""

import os
import re
import shlex
import shutil
import subprocess
import sys

import click
import pytest
from click.testing import CliRunner

import stickslip as ss
from mode_coupling import mode_coupling
from stickslip.cli import main

COMMAND = [sys.executable, "-c", "from stickslip.cli import main; main(prog_name='stickslip')"]
VERBS = sorted(main.commands)


def run(*arguments, code=0):
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exit_code == code, result.output
    return result


def process(*arguments, **options):
    options = {"stderr": subprocess.PIPE, "text": True, **options}
    return subprocess.run([*COMMAND, *map(str, arguments)], **options)


@pytest.fixture(scope="module")
def brake(tmp_path_factory):
    path = tmp_path_factory.mktemp("ends") / "brake.toml"
    run("init", path)
    return path


def examples():
    """The commands that help shows."""
    for verb in [None, *VERBS]:
        shown = run(*([verb] if verb else []), "--help").stdout
        for line in shown.split("Example:")[1].splitlines():
            if found := re.match(r" +(stickslip .*?)(   .*)?$", line):
                for command in re.split(r" && | >> ", found[1]):
                    if command.startswith("stickslip"):
                        yield command


@pytest.mark.process
@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_a_shell_hands_over_the_examples_of_help_as_they_stand():
    """Bash expands braces; zsh, and bash with failglob, refuse brackets that match no file."""
    commands = list(examples())
    assert len(commands) > len(VERBS)
    for command in commands:
        script = f"printf '%s\\n' {command}"
        done = subprocess.run(["bash", "-O", "failglob", "-c", script], capture_output=True, text=True)
        assert done.stderr == ""
        assert done.stdout.splitlines() == shlex.split(command)
    assert "stickslip study brake.toml --over 'friction={uniform=[0.3,2.5]}'" in " ".join(commands)


def test_what_help_says_to_type_is_quoted():
    for verb in VERBS:
        text = " ".join(run(verb, "--help").stdout.split())
        assert re.findall(r"(?<!['{])\b\w+=[\[{]\w", text.replace("NAME=[values]", "")) == []


@pytest.mark.process
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no full device")
@pytest.mark.parametrize(
    "arguments", [["modes", "SCENE"], ["modes", "SCENE", "--csv"], ["modes", "--help"], ["--help"]]
)
def test_a_full_disk_is_told_in_one_line(brake, arguments):
    with open("/dev/full", "w") as full:
        done = process(*(brake if a == "SCENE" else a for a in arguments), stdout=full)
    assert done.returncode == 2
    assert done.stderr == "Error: cannot write: No space left on device\n"


@pytest.mark.process
@pytest.mark.skipif(sys.platform == "win32", reason="pipes end otherwise there")
@pytest.mark.parametrize(
    "arguments", [["modes", "SCENE"], ["simulate", "SCENE", "--csv"], ["cycle", "SCENE"], ["--help"]]
)
def test_a_closed_pipe_ends_a_command_in_silence(brake, arguments):
    reader, writer = os.pipe()
    os.close(reader)
    done = process(*(brake if a == "SCENE" else a for a in arguments), stdout=writer)
    os.close(writer)
    assert done.returncode == 2
    assert done.stderr == ""


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no full device")
def test_a_file_on_a_full_disk_is_named(brake, tmp_path):
    target = tmp_path / "modes.csv"
    target.symlink_to("/dev/full")
    assert f"Error: {target}: No space left on device" in run("modes", brake, "-o", target, code=2).stderr
    figure = tmp_path / "modes.png"
    figure.symlink_to("/dev/full")
    assert f"Error: {figure}: No space left on device" in run("modes", brake, "--plot", figure, code=2).stderr
    page = tmp_path / "page.html"
    page.symlink_to("/dev/full")
    written = run("report", brake, "-o", page, "--duration", 0.01, code=2)
    assert f"Error: {page}: No space left on device" in written.stderr


@pytest.mark.process
@pytest.mark.parametrize(("encoding", "angle"), [("cp1252", "at 0.0° "), ("ascii", "at 0.0 deg")])
def test_output_has_other_letters_where_the_encoding_has_none(brake, encoding, angle):
    """Windows writes files and pipes in its code page."""
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    done = process("cycle", brake, stdout=subprocess.PIPE, text=False, env=environment)
    assert done.returncode == 0, done.stderr
    printed = done.stdout.decode(encoding)
    assert angle.strip() in printed
    assert "8.90849261 ms" in printed


@pytest.mark.process
def test_names_that_the_encoding_does_not_have_are_escaped(tmp_path):
    path = tmp_path / "belt.toml"
    run("init", path, "--model", "oscillator")
    path.write_text(path.read_text().replace('"along"', '"längś→"').replace("{ along", '{ "längś→"'), "utf-8")
    environment = {**os.environ, "PYTHONIOENCODING": "cp1252", "PYTHONUTF8": "0"}
    done = process("modes", path, "--csv", stdout=subprocess.PIPE, env=environment, encoding="cp1252")
    assert done.returncode == 0
    assert "shape_real_läng\\u015b->" in done.stdout


def test_a_defect_is_no_negative_answer(brake, monkeypatch):
    def broken(*_arguments, **_options):
        raise KeyError("oops")

    monkeypatch.setattr(ss, "complex_modes", broken)
    done = run("modes", brake, code=4)
    assert "KeyError: 'oops'" in done.stderr
    assert "a defect of stickslip" in done.stderr


def test_an_answer_is_1_only_where_it_is_no(brake, monkeypatch):
    assert "no limit cycle (equilibrium)" in run("cycle", brake, "--set", "friction=0.5", code=1).stderr

    def stopped(_run, _further, time_limit):
        raise ss.NotPeriodicError("stopped by time_limit", None, "stopped", float("nan"), float("nan"))

    monkeypatch.setattr(ss.Trajectory, "limit_cycle", stopped)
    assert "stopped by time_limit" in run("cycle", brake, "--duration", 0.01, code=3).stderr


def test_interrupted_before_the_verb_begins(monkeypatch):
    def interrupted(*_arguments, **_more):
        raise KeyboardInterrupt

    monkeypatch.setattr(click.Group, "make_context", interrupted)
    assert "interrupted" in run("modes", code=130).stderr


@pytest.mark.process
def test_warnings_show_no_source(brake):
    done = process("study", brake, "--sampler", "sobol", "--samples", 100, "--csv", stdout=subprocess.PIPE)
    assert done.stderr == (
        "warning: samples: a Sobol' sequence is balanced for powers of two only, got 100; nearest 128\n"
    )


def test_without_a_start_a_cycle_is_looked_for_beside_unstable_sliding(tmp_path):
    path = tmp_path / "coupled.toml"
    ss.save(mode_coupling(), path)
    assert "period               6.29102074 s" in run("cycle", path, "--duration", 200).stdout
    assert "hint: the run begins in exact steady sliding" in run("simulate", path, "--duration", 20).stderr
    moving = run("simulate", path, "--duration", 200, "--start", "velocity.x=0.1")
    assert "hint" not in moving.stderr


def test_a_search_of_the_command_line_has_a_time_limit(brake):
    arguments = ("--duration", 0.01, "--further", 1e9, "--time-limit", 1e-9)
    assert (
        "the time limit of computing, 1e-09 s, was reached" in run("cycle", brake, *arguments, code=3).stderr
    )


def test_a_negative_frequency_is_refused(brake):
    assert "-5.0 is not in the range x>=0.0" in run("modes", brake, "--near", -5, code=2).stderr
