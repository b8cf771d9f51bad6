#!/usr/bin/env python3
"""Instructions that valgrind counts in queries, a build and a check, against those of instructions.csv.

Unlike times, they are the same on every run and every machine that has AVX2: valgrind's processor is always the same one,
without AVX-512, so that the vectors of 8 lanes are chosen and libc chooses its functions alike. Another compiler or another
valgrind counts otherwise; then the test is skipped (exit code 77).

Usage: instructions.py [BUILD] [--update]     BUILD: the folder of a release build (build/release)
"""

import argparse
import csv
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

GROWTH = 1.02
SKIPPED = 77
SOURCE = Path(__file__).resolve().parents[2]
FILE = Path(__file__).with_name("instructions.csv")
COLUMNS = ["name", "instructions", "commit", "compiler", "valgrind"]
# A step calls these: it places the bodies and asks for contacts.
QUERY = ("tandem::Scene::place(", "tandem::ContactQuery::answer(")


def skip(reason):
    print("skipped:", reason)
    sys.exit(SKIPPED)


def output_of(command, **options):
    # The command does not get the caller's environment, whose size moves the stack.
    result = subprocess.run(command, env={"PATH": os.defpath}, text=True, capture_output=True, check=False, **options)
    if result.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    return result.stdout


def count(functions, command, folder):
    """Instructions of functions and all that these call, together; of overloads the outermost."""
    profile = folder / "profile"
    output_of(["valgrind", "--tool=callgrind", f"--callgrind-out-file={profile}", *command], cwd=folder)
    table = output_of(["callgrind_annotate", "--inclusive=yes", "--threshold=100", profile])
    total = 0
    for function in functions:
        counts = [int(line.split()[0].replace(",", "")) for line in table.splitlines()
                  if re.match(r" *[\d,]+ ", line) and f":{function}" in line]
        if not counts:
            sys.exit(f"no call of {function} was counted in {' '.join(map(str, command))}")
        total += max(counts)
    return total


def compiler_of(build):
    """Name and version, as CMake found them."""
    text = next(build.glob("CMakeFiles/*/CMakeCXXCompiler.cmake")).read_text()
    return " ".join(re.search(rf'set\(CMAKE_CXX_COMPILER_{key} "(.*)"\)', text)[1] for key in ("ID", "VERSION"))


def count_all(build, folder):
    assets = SOURCE / "assets"
    bvhbuild, bvhinfo, bvhbench = (build / "tools" / tool / tool for tool in ("bvhbuild", "bvhinfo", "bvhbench"))
    for asset in ("box_48", "cow_1500", "ground"):
        output_of([bvhbuild, assets / f"{asset}.obj", "-o", folder / f"{asset}.bvh", "--quiet"])

    def query(kind, *options):
        output_of([bvhbench, "scene", kind, *options, "-o", f"{kind}.h5"], cwd=folder)
        return count(QUERY, [bvhbench, "query", f"{kind}.h5", "--threads", "1"], folder)

    return {
        "query of a pile": query("pile", "--mesh", "cow_1500.bvh", "--count", "500"),
        "query of an exact stack": query("stack", "--mesh", "box_48.bvh", "--count", "125", "--exact"),
        "query of a slide": query("slide", "--mesh", "cow_1500.bvh", "--ground", "ground.bvh", "--count", "1000"),
        "build": count(["tandem::build::run_pipeline("],
                       [bvhbuild, assets / "cow.obj", "-o", "built.bvh", "--quiet", "--threads", "1"], folder),
        "check": count(["tandem::check("], [bvhinfo, "--verify", "ground.bvh"], folder),
    }


def commit():
    """The last commit, with a + where what was counted holds changes that are not committed yet."""
    git = ["git", "-C", SOURCE]
    name = subprocess.run([*git, "rev-parse", "--short=10", "HEAD"], text=True, capture_output=True, check=True).stdout
    changed = subprocess.run([*git, "diff", "--quiet", "HEAD", "--", f":!{FILE}"], check=False).returncode
    return name.strip() + "+" * changed


def write(counts, compiler, valgrind):
    with FILE.open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(COLUMNS)
        made = commit()
        rows.writerows([name, number, made, compiler, valgrind] for name, number in counts.items())


def compare(kept, counts):
    """Prints each count beside that of the file; returns the names of those that grew."""
    grown = []
    for name, number in counts.items():
        before = int(kept[name]["instructions"])
        print(f"{name:<25} {number:>13,} instructions, {100 * (number / before - 1):+.2f} % of {before:,}"
              f" at {kept[name]['commit']}")
        if number > GROWTH * before:
            grown.append(name)
    return grown


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", nargs="?", type=Path, default=SOURCE / "build/release", metavar="BUILD")
    parser.add_argument("--update", action="store_true", help="write instructions.csv anew, for a change whose cost is meant")
    arguments = parser.parse_args()
    if shutil.which("valgrind") is None:
        skip("there is no valgrind")
    if "avx2" not in Path("/proc/cpuinfo").read_text():
        skip("this machine has no AVX2")
    compiler, valgrind = compiler_of(arguments.build), output_of(["valgrind", "--version"]).strip()
    with FILE.open(newline="") as file:
        kept = {row["name"]: row for row in csv.DictReader(file)}
    for row in kept.values():
        if not arguments.update and (row["compiler"], row["valgrind"]) != (compiler, valgrind):
            skip(f"counted with {row['compiler']} and {row['valgrind']}; here are {compiler} and {valgrind}")

    with tempfile.TemporaryDirectory() as folder:
        counts = count_all(arguments.build.resolve(), Path(folder))
    if arguments.update:
        write(counts, compiler, valgrind)
        return
    if kept.keys() != counts.keys():
        sys.exit(f"{FILE} holds other names: write it anew with --update")
    grown = compare(kept, counts)
    if grown:
        sys.exit(f"more than {100 * (GROWTH - 1):.0f} % more instructions: {', '.join(grown)}. "
                 "Where that is meant: tests/cost/instructions.py --update, and say why in the commit.")


if __name__ == "__main__":
    main()
