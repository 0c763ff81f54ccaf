"""No name of a type is declared twice in the product (compute, shaders/interface, module, integration).

A class, struct, union, enum or alias counts wherever it stands: in a class, in a function and in a file's unnamed
namespace too. Forward declarations and specialisations do not count, nor do aliases that say the same in many files.

usage: types_test.py SOURCE_DIR
"""

import collections
import os
import re
import sys

FOLDERS = ("compute", "shaders/interface", "module", "integration")
# {name: why it may be declared more than once}
ALLOWED = {
    "Kind": "always in the class whose kinds it names, and said with it: Primitive::Kind, SessionEvent::Kind",
}

NOT_CODE = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.DOTALL)
DECLARED = re.compile(
    r"\b(?:class|struct|union|enum(?:\s+(?:class|struct))?)\s+(?:\[\[[^\]]*\]\]\s*|alignas\([^)]*\)\s*|[A-Z_]+\s+)*"
    r"(?P<type>[A-Za-z_]\w*)\s*(?:final\s*)?(?::(?!:)[^;{}()]*)?\{"
    r"|\busing\s+(?P<alias>[A-Za-z_]\w*)\s*=(?P<target>[^;]*);"
    r"|\btypedef\b[^;{}]*?(?P<typedef>[A-Za-z_]\w*)\s*;")


def blank(match):
    """As many lines as were there, and nothing else."""
    return "\n" * match.group().count("\n") or " "


def types_of(path):
    """(name, line, target) of each type that a file declares; the target of an alias, else None."""
    with open(path, encoding="utf-8") as file:
        text = NOT_CODE.sub(blank, file.read())
    for match in DECLARED.finditer(text):
        name = match["type"] or match["alias"] or match["typedef"]
        target = match["target"] and " ".join(match["target"].split())
        # Only a shorter name: using Kind = Primitive::Kind.
        if not (target and target.endswith("::" + name)):
            yield name, text.count("\n", 0, match.start()) + 1, target


def main():
    root = sys.argv[1]
    places, targets = collections.defaultdict(list), collections.defaultdict(set)
    for top in FOLDERS:
        for folder, _, names in sorted(os.walk(os.path.join(root, top))):
            for name in sorted(names):
                if name.endswith((".h", ".cpp")):
                    path = os.path.join(folder, name)
                    for type_name, line, target in types_of(path):
                        places[type_name].append(f"{os.path.relpath(path, root)}:{line}")
                        targets[type_name].add(target)
    if len(places) < 100:
        sys.exit(f"Only {len(places)} types were found: this check no longer reads the code.")
    # Aliases of one name for one type may be in many files: using Clock = std::chrono::steady_clock.
    twice = {name: where for name, where in places.items()
             if len(where) > 1 and (None in targets[name] or len(targets[name]) > 1)}
    wrong = {name: where for name, where in twice.items() if name not in ALLOWED}
    for name, where in sorted(wrong.items()):
        print(f"{name}: {', '.join(where)}")
    if wrong:
        print(f"{len(wrong)} names of types are declared more than once. Give each type a name of its own.")
    idle = sorted(set(ALLOWED) - set(twice))
    if idle:
        print(f"No longer declared twice, so not to be in ALLOWED: {', '.join(idle)}")
    return 1 if wrong or idle else 0


if __name__ == "__main__":
    sys.exit(main())
