"""Search code, tests and docs, or the paths given, for words that `words.txt` replaces."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
WORDS = ROOT / "scripts" / "words.txt"
ENDINGS = {".py", ".pyi", ".c", ".h", ".md", ".toml", ".sh", ".txt", ""}
EXAMPLES = ROOT / "tests" / "workshop" / "test_words.py"
NAMES = "(?# names"  # patterns with this comment distinguish capitals


def main(paths: list[str]) -> int:
    """Print each line that holds such a word, with its place and the replacement; 1 if there is any."""
    lines = [line for line in WORDS.read_text("utf-8").splitlines() if line and not line.startswith("#")]
    rules = [line.rsplit(" => ", 1) for line in lines]
    compiled = [(re.compile(p, 0 if NAMES in p else re.IGNORECASE), words) for p, words in rules]
    command = ["git", "ls-files", *paths]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)  # noqa: S603
    count = 0
    for name in listed.stdout.splitlines():
        path = ROOT / name
        if path.suffix not in ENDINGS or path in (WORDS, EXAMPLES) or "golden" in path.parts or name == "CHANGELOG.md":
            continue
        for number, text in enumerate(path.read_text("utf-8").splitlines(), start=1):
            for pattern, words in compiled:
                if (found := pattern.search(text)) and "words: " not in text:
                    count += 1
                    print(f"{name}:{number}: '{found[0]}': write: {words}")
    print(f"{count} words to replace" if count else "All words are plain")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
