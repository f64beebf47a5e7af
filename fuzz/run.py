#!/usr/bin/env python3
"""Builds the fuzzers with the stable compiler and runs each for a processor time, one after another:

    fuzz/run.py [--seconds 600] [TARGET ...]

Targets are `mjcf`, `mesh`, `batch`, `mlagents`, and the readers `motion-0` to `motion-4` and `files-0` to `files-7`. New inputs
go to corpus/TARGET, inputs that fail to artifacts/TARGET-..., and an interrupted run continues from the corpus. Prints
a row per target; the exit code is 1 if one failed. Needs a C++ compiler.
"""

import argparse
import os
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
# what cargo-fuzz passes, without the sanitizers, which need a nightly compiler
FLAGS = (
    "--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 "
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table "
    "-Cllvm-args=-sanitizer-coverage-trace-compares -Cdebug-assertions -Ccodegen-units=4"
)
MODELS = [
    ROOT / folder
    for folder in ("crates/physics/tests/models/mjcf", "crates/physics/tests/models/full", "assets/agents")
]
# target: program, environment, largest input, seconds for one input, seeds and further arguments
TARGETS = {
    "mjcf": ("mjcf", {}, 8192, 20, [*map(str, MODELS), f"-dict={HERE / 'mjcf.dict'}"]),
    "mesh": ("mesh", {}, 8192, 20, []),
    "batch": ("batch", {}, 2048, 30, []),
    "mlagents": ("mlagents", {}, 4096, 10, []),
    **{f"motion-{i}": ("motion", {"MOTION_READER": str(i)}, 8192, 10, []) for i in range(5)},
    **{f"files-{i}": ("files", {"FILE_READER": str(i)}, 65536, 10, []) for i in range(8)},
}
# an input may not need more, MB
MEMORY = 1024
# wall time of one start of a fuzzer, s; the processor time is looked at in between
SLICE = 120


def build(host):
    """Compiles the fuzzers and writes the seeds; returns the folder of the programs."""
    environment = {**os.environ, "RUSTFLAGS": FLAGS}
    # a target keeps the flags away from build scripts
    subprocess.run(["cargo", "build", "--release", "--bins", "--target", host], cwd=HERE, env=environment, check=True)
    subprocess.run(["cargo", "build", "--release", "--package", "marathon-cli"], cwd=ROOT, check=True)
    subprocess.run([sys.executable, HERE / "seeds.py"], check=True)
    return Path(os.environ.get("CARGO_TARGET_DIR", HERE / "target")) / host / "release"


def fuzz(name, programs, seconds, scratch):
    """Runs a fuzzer until it has used its time or fails.

    Returns processor seconds, inputs, most memory in MB, and whether it failed.
    """
    program, environment, length, timeout, more = TARGETS[name]
    corpus, artifacts = HERE / "corpus" / name, HERE / "artifacts"
    corpus.mkdir(parents=True, exist_ok=True)
    artifacts.mkdir(exist_ok=True)
    limits = [
        f"-max_len={length}",
        f"-rss_limit_mb={MEMORY}",
        f"-timeout={timeout}",
        f"-artifact_prefix={artifacts / name}-",
    ]
    used, inputs, most = 0.0, 0, 0
    while used < seconds:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        left = max(10, min(SLICE, int(1.2 * (seconds - used))))
        words = [programs / program, corpus, *more, *limits, f"-max_total_time={left}", "-print_final_stats=1"]
        # files are written to memory where there is such a folder: a disk would take most of the time
        told = {**os.environ, **environment, "TMPDIR": scratch}
        run = subprocess.run(words, check=False, env=told, capture_output=True, text=True, errors="replace")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used += after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        counts = dict(re.findall(r"stat::(\w+): +(\d+)", run.stderr))
        inputs += int(counts.get("number_of_executed_units", 0))
        most = max(most, int(counts.get("peak_rss_mb", 0)))
        if run.returncode:
            print(run.stderr[-4000:], file=sys.stderr)
            return used, inputs, most, True
    return used, inputs, most, False


def main():
    """Fuzzes the chosen targets."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="targets (default: all)")
    parser.add_argument("--seconds", type=float, default=600, help="processor time for each target (default: 600)")
    options = parser.parse_args()
    unknown = [name for name in options.targets if name not in TARGETS]
    if unknown:
        parser.error(f"no target {unknown[0]!r}, expected some of {', '.join(TARGETS)}")
    host = re.search(
        r"host: (\S+)", subprocess.run(["rustc", "-vV"], capture_output=True, text=True, check=True).stdout
    )[1]
    programs = build(host)
    memory = Path("/dev/shm")
    failed = []
    with tempfile.TemporaryDirectory(dir=memory if memory.is_dir() else None) as scratch:
        for name in options.targets or TARGETS:
            used, inputs, most, fails = fuzz(name, programs, options.seconds, scratch)
            print(
                f"{name}: {used:.0f} s of processor time, {inputs:,} inputs, at most {most} MB{', FAILED' * fails}",
                flush=True,
            )
            failed += [name] * fails
    sys.exit(f"failed: {', '.join(failed)}" if failed else 0)


if __name__ == "__main__":
    main()
