#!/usr/bin/python3
"""Fails on words that are not the field's: in comments of the sources and in Markdown.

    tests/language_test.py SOURCE_DIR
"""
import pathlib
import re
import sys

# Each word with what is written in its place.
STOP_WORDS = {
    r"told|tells": "states, reports, known",
    r"beside": "next to, compared with, in addition to, except",
    r"parted": "separated",
    r"comes? by|came by": "the origin of",
    r"stands? out|standing out": "exceeds, is visible",
    r"in the way": "exists already",
    r"cures?": "suggestion, remedy",
    r"wish(es)?": "request",
    r"house": "architecture",
    r"beaten by": "dominated by",
    r"(?<!there )is no(?! longer| more)(?= (number|valid|colour|light|mosaic|picture|noise|time|star)\b)": "is not a",
    r"made-up": "warm-up, synthetic",
    r"somebody|nobody": "the passive voice, or who it is",
    r"takes? off|took off|taken off": "subtracts, removes",
    r"(?<!two )frames before(?= (alone|and|are|contribute|of|where)\b)": "previous frames",
    r"be had": "be available",
    r"go(es)? by|going by": "follows, is based on",
    r"pil(es?|ing) up": "accumulates, has a peak",
    r"whole or not at all": "completely or not at all",
    r"beats?": "is better than",
    r"stands? in for|stand-ins?": "replaces, substitute",
    r"besides": "in addition to",
    r"looked at": "read, examined, viewed",
    r"comes? out|came out": "is, becomes",
    r"for want of": "because there is no",
    r"what is not \w+ is not": "the subject of the sentence",
    r"none of .{1,20} business": "does not concern",
    r"absurd": "implausible",
    r"heed(s|ed)?": "uses, takes effect",
}
FOLDERS = ("capture", "calib", "denoise", "isp")
PATTERNS = {re.compile(rf"\b(?:{words})\b", re.IGNORECASE): instead for words, instead in STOP_WORDS.items()}
COMMENT = re.compile(r'"(?:\\.|[^"\\\n])*"|//[^\n]*|/\*.*?\*/', re.DOTALL)


def prose(path):
    """@return text of a file with everything but prose blanked, line by line as it was"""
    text = path.read_text()
    if path.suffix == ".md":
        return re.sub(r"```.*?```|`[^`\n]*`", lambda m: re.sub(r"[^\n]", " ", m.group()), text, flags=re.DOTALL)
    out, at = [], 0
    for found in COMMENT.finditer(text):
        out.append(re.sub(r"[^\n]", " ", text[at:found.start()]))
        is_comment = found.group().startswith("/")
        out.append(found.group() if is_comment else re.sub(r"[^\n]", " ", found.group()))
        at = found.end()
    return "".join(out) + re.sub(r"[^\n]", " ", text[at:])


def main():
    root = pathlib.Path(sys.argv[1])
    files = [root / name for name in ("README.md", "CONTRIBUTING.md")] + sorted((root / "docs").rglob("*.md"))
    for folder in FOLDERS:
        files += sorted(path for path in (root / folder).rglob("*") if path.suffix in (".h", ".cpp", ".md"))
    faults = 0
    for path in files:
        for number, line in enumerate(prose(path).split("\n"), 1):
            for pattern, instead in PATTERNS.items():
                for found in pattern.finditer(line):
                    faults += 1
                    print(f"{path.relative_to(root)}:{number}: '{found.group()}': write {instead}")
    if len(files) < 10:
        sys.exit(f"only {len(files)} files below {root}: not the source folder?")
    print(f"{len(files)} files, {faults} words that are not the field's")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
