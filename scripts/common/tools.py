"""Runs the project's tools. Needs nothing but Python's standard library."""
import argparse
import contextlib
import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


class ToolFailed(SystemExit):
    """A command failed. A script that does not catch this ends with the command's own message and exit code 1."""


def tool(name, preset="release"):
    """The path of a tool: what TANDEM_BVHBENCH and its like say, else the one in the folder TANDEM_BUILD, else the one that the preset builds."""
    build = os.environ.get("TANDEM_BUILD", ROOT / "build" / preset)
    return Path(os.environ.get(f"TANDEM_{name.upper()}", Path(build) / "tools" / name / name)).absolute()


def run(*command, **options):
    """Runs a command and returns what it prints. The options are those of subprocess.run. Raises ToolFailed."""
    words = [str(word) for word in command]
    try:
        done = subprocess.run(words, capture_output=True, text=True, errors="replace", **options)
    except OSError as defect:
        raise ToolFailed(f"{words[0]}: {defect.strerror}") from defect
    if done.returncode != 0:
        raise ToolFailed(f"{shlex.join(words)}: exit code {done.returncode}: {(done.stderr or done.stdout).strip()}")
    return done.stdout


def run_json(*command, **options):
    return json.loads(run(*command, **options))


def commit():
    """What TANDEM_COMMIT says, else the commit that is checked out, shortened, else "unknown"."""
    told = os.environ.get("TANDEM_COMMIT")
    try:
        return told or run("git", "rev-parse", "--short", "HEAD", cwd=ROOT).strip()
    except ToolFailed:
        return "unknown"


def parser(description):
    """A parser of options whose help is the description as it is written."""
    return argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)


@contextlib.contextmanager
def reading(*paths):
    """Where the block cannot read the files, or does not find in them what it needs, ends the script: a message that names script and files, exit code 2."""
    try:
        yield
    except (OSError, KeyError, ValueError) as defect:
        print(f"{Path(sys.argv[0]).name}: {', '.join(map(str, paths))}: {defect}", file=sys.stderr)
        raise SystemExit(2) from defect
