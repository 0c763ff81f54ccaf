"""No sentence of a comment has more than 40 words: sentences_test.py ROOT"""
import os
import re
import sys

MOST = 40
SUFFIXES = (".c", ".comp", ".cpp", ".cxx", ".frag", ".glsl", ".h", ".vert")
# A word of the language; names, numbers and formulas are none.
WORD = re.compile(r"^[(\"'`]*[A-Za-z][a-z]*(?:['-][A-Za-z]+)*[)\"'`.,:;!?]*$")


def blocks(text):
    """Line and lines of each comment that stands on lines of its own."""
    first, block = 0, []
    for n, line in enumerate(text.split("\n"), 1):
        found = re.match(r"\s*//[/!]?<?(.*)", line)
        if found:
            first = first if block else n
            block.append(found.group(1))
        elif block:
            yield first, block
            block = []


def sentences(block):
    """Sentences of the running text. Empty lines end one, and so do rows of tables, formulas, lists."""
    text = ""
    for line in block + [""]:
        is_row = not line.strip() or re.search(r"\S {2,}\S", line) or line.startswith("   ") or re.match(r"\s*[-*|\\@]", line)
        if is_row:
            yield from re.split(r"(?<=[.!?])[)\"'`]*\s+", text)
            text = ""
        else:
            text += " " + line.strip()


def main(root):
    trouble = []
    for folder, names, files in os.walk(root):
        names[:] = [name for name in names if name != ".git" and not name.startswith("build")]
        for file in files:
            if not file.endswith(SUFFIXES):
                continue
            path = os.path.join(folder, file)
            with open(path, encoding="utf-8", errors="replace") as opened:
                text = opened.read()
            for line, block in blocks(text):
                for sentence in sentences(block):
                    count = sum(1 for word in sentence.split() if WORD.match(word))
                    if count > MOST:
                        trouble.append((count, f"{os.path.relpath(path, root)}:{line}: {count} words: {sentence.strip()}"))
    for _, t in sorted(trouble, reverse=True):
        print(t)
    return 1 if trouble else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
