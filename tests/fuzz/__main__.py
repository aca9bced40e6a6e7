"""The hostile suite at length: `python -m tests.fuzz`, or scripts/fuzz."""

from __future__ import annotations

import argparse
import sys

from tests.fuzz.summary import PARTS, run


def main() -> int:
    """Run one part or all, print what was tried and found; 1 if anything was found."""
    parser = argparse.ArgumentParser(
        prog="scripts/fuzz",
        description="Hostile input: damaged and malicious files, calls and interruptions. A seed repeats a trial.",
    )
    parser.add_argument("part", nargs="?", choices=PARTS, metavar="PART", help=f"{', '.join(PARTS)}; default: all")
    parser.add_argument("--seed", type=int, default=0, help="of the first trial, the others count on from it; 0")
    parser.add_argument("--seconds", type=float, default=60.0, help="for each part; 0: one trial; 60")
    given = parser.parse_args()
    found = 0
    for part in [given.part] if given.part else PARTS:
        summary = run(part, given.seed, given.seconds)
        print("\n".join(summary.lines()), flush=True)
        found += len(summary.findings)
    print("nothing found" if not found else f"{found} findings")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
