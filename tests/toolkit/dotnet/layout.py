"""Writes a C program that prints what headers declare, as the C compiler has it, for comparison with a binding:

    struct NAME SIZE            field NAME.FIELD OFFSET SIZE
    value NAME NUMBER           function NAME NUMBER_OF_ARGUMENTS

A structure inside another one is named after both: PalState.volumes[0] is PalStateVolume.

usage: layout.py OUTPUT.c HEADER...
"""

import os
import re
import sys

MEMBER = re.compile(r"(\w+)\s*((?:\[\w+\])*)\s*$")


def members(body):
    """(name, inner body or None) of each member of a structure."""
    body = re.sub(r"\s+", " ", body)
    while body.strip():
        inner = re.match(r"\s*struct \{(.*?)\}\s*(\w+)\[\w+\];", body)
        if inner:
            yield inner[2], inner[1]
            body = body[inner.end():]
            continue
        pointer = re.match(r"\s*[^;{}]*?\(\*(\w+)\)\([^;]*\);", body)
        if pointer:
            yield pointer[1], None
            body = body[pointer.end():]
            continue
        declaration, body = body.split(";", 1)
        for one in declaration.split(","):
            yield MEMBER.search(one)[1], None


def main(output, *headers):
    text = ""
    for header in headers:
        with open(header, encoding="utf-8") as file:
            text += re.sub(r"/\*.*?\*/", "", file.read(), flags=re.DOTALL)
    lines = []

    def say(what, *numbers):
        lines.append(f'  printf("{what}{" %lld" * len(numbers)}\\n"{"".join(f", (long long)({n})" for n in numbers)});')

    for name, body in re.findall(r"typedef struct (\w+) \{(.*?)\n\} \1;", text, re.DOTALL):
        say(f"struct {name}", f"sizeof({name})")
        for field, inner in members(body):
            say(f"field {name}.{field}", f"offsetof({name}, {field})", f"sizeof((({name}*)0)->{field})")
            if inner:
                one = name + field[0].upper() + field[1:-1]
                say(f"struct {one}", f"sizeof((({name}*)0)->{field}[0])")
                for part, _ in members(inner):
                    say(f"field {one}.{part}", f"offsetof({name}, {field}[0].{part}) - offsetof({name}, {field}[0])",
                        f"sizeof((({name}*)0)->{field}[0].{part})")
    for kind, body in re.findall(r"\benum (\w*)\s*\{(.*?)\}", text, re.DOTALL):
        for value in re.findall(r"\b(PAL_\w+)\s*=", body):
            if not value.endswith("_MAX"):
                say(f"value {value}", value)
    say("value PAL_VERSION", "PAL_VERSION")
    for name, arguments in re.findall(r"PAL_API[^;(]*?\b(pal(?:pate)?_\w+)\(([^;]*)\);", text):
        say(f"function {name}", 0 if arguments.strip() == "void" else arguments.count(",") + 1)
    with open(output, "w", encoding="utf-8") as file:
        file.write("#include <stdio.h>\n")
        file.writelines(f'#include "{os.path.basename(header)}"\n' for header in headers)
        file.write('int main(void) {\n' + "\n".join(lines) + "\n  return 0;\n}\n")


main(*sys.argv[1:])
