"""Search code, tests and docs, or the paths given, for words that `words.txt` replaces."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
WORDS = ROOT / "scripts" / "words.txt"
ENDINGS = {".py", ".pyi", ".c", ".h", ".js", ".html", ".css", ".md", ".toml", ".sh", ".txt", ".yml", ""}
NAMES = "(?# names"  # patterns with this comment distinguish capitals


def rules() -> list[tuple[re.Pattern[str], str]]:
    """Return the patterns of `words.txt`, and for each what to write instead."""
    lines = [line for line in WORDS.read_text("utf-8").splitlines() if line and not line.startswith("#")]
    pairs = [line.rsplit(" => ", 1) for line in lines]
    return [(re.compile(p, 0 if NAMES in p else re.IGNORECASE), words) for p, words in pairs]


def found_in(pattern: re.Pattern[str], text: str) -> re.Match[str] | None:
    """Return what a pattern finds in a line, also within identifiers, whose words '_' or a capital separates."""
    found = pattern.search(text)
    if found or not pattern.flags & re.IGNORECASE:
        return found
    return pattern.search(re.sub("(?<=[a-z])(?=[A-Z])", " ", text).replace("_", " "))


def main(paths: list[str]) -> int:
    """Print each line that holds such a word, with its place and the replacement; 1 if there is any."""
    compiled = rules()
    command = ["git", "ls-files", *paths]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)  # noqa: S603
    count = 0
    for name in listed.stdout.splitlines():
        path = ROOT / name
        if path.suffix not in ENDINGS or path == WORDS or "golden" in path.parts or name == "CHANGELOG.md":
            continue
        for number, text in enumerate(path.read_text("utf-8").splitlines(), start=1):
            for pattern, words in compiled:
                found = found_in(pattern, text)
                if found and "words: " not in text:
                    count += 1
                    print(f"{name}:{number}: '{found[0]}': write: {words}")
    print(f"{count} words to replace" if count else "All words are plain")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
