"""Prints a C header with its plain comments as doxygen's: usage c_comments.py HEADER.

A comment above a declaration becomes /** */, one behind it /**< */; "/* ---- name ----" begins a group; the first comment is the file's.
"""
import re
import sys
from pathlib import Path

lines = []
groups = 0
for line in Path(sys.argv[1]).read_text().splitlines():
    group = re.match(r"/\* ---- (.*?) ----(.*)", line)
    if group:
        title, rest = group.groups()
        if groups:
            lines.append("/** @} */")
        lines.append(f"/** \\defgroup {re.sub(r'[^a-z]+', '_', title)} {title[0].upper() + title[1:]}")
        # The text of the section, if there is one, ends the comment below.
        lines.append("\\{ */" if rest.strip() == "*/" else "\\{")
        groups += 1
    elif not groups and re.match(r" {7}\S", line):
        # A list in the file's comment, by indentation only.
        lines.append("       - " + re.sub(r"(\S)\s{2,}(\S)", r"\1: \2", line.strip()))
    elif not lines:
        lines.append(line.replace("/*", "/** \\file", 1).replace("\\file", "\\file\n", 1))
    elif re.match(r"\s*/\*", line):
        lines.append(line.replace("/*", "/**", 1))
    elif "/*" in line:
        lines.append(line.replace("/*", "/**<", 1))
    else:
        lines.append(line)
if groups:
    lines.append("/** @} */")
# Doxygen keeps a line's end within quotes, and a paragraph would end there.
print(re.sub(r'"([^"\n]*)\n +([^"\n]*)"', r'"\1 \2"', "\n".join(lines)))
