#!/usr/bin/env python3
"""Checks that relative links of the Markdown files, and the paths they name in backquotes, exist.

usage: check_links.py PROJECT_ROOT
"""
import re
import sys
from pathlib import Path

LINK = re.compile(r"\[[^\]]*\]\(([^)#\s]+)(?:#[^)]*)?\)")
PATH = re.compile(r"`((?:src|tools|tests|docs|include|shaders)/[\w./-]+\.\w+)`")


def main() -> int:
    root = Path(sys.argv[1]).resolve()
    pages = sorted(root.glob("*.md")) + sorted((root / "docs").rglob("*.md"))
    if not pages:
        print(f"error: no pages under {root}")
        return 1
    broken = []
    for page in pages:
        for number, line in enumerate(page.read_text().splitlines(), 1):
            targets = [page.parent / t for t in LINK.findall(line) if "://" not in t and not t.startswith("mailto:")]
            targets += [root / t for t in PATH.findall(line)]
            broken += [f"{page.relative_to(root)}:{number}: {t} does not exist" for t in targets if not t.exists()]
    print("\n".join(broken) if broken else f"the links of {len(pages)} pages lead somewhere")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
