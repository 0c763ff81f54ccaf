"""Makes a page for each command out of the manual pages that the program writes: usage commands.py MAN1 REFERENCE."""
import re
import sys
from pathlib import Path


def plain(text):
    """Text of a manual page without troff's escapes."""
    for escape, character in ((r"\-", "-"), (r"\(aq", "'"), (r"\(ha", "^"), (r"\(ti", "~"), (r"\&", ""), (r"\e", "\\")):
        text = text.replace(escape, character)
    return text


def markdown(text):
    """The same as Markdown: bold and italic words as code and emphasis, all else as it is."""
    parts = re.split(r"\\f([BI])(.*?)\\fR", text)
    out = re.sub(r"([\\`*_<>\[\]|{}])", r"\\\1", plain(parts[0]))
    for kind, word, rest in zip(parts[1::3], parts[2::3], parts[3::3]):
        out += f"`{plain(word)}`" if kind == "B" else f"*{plain(word)}*"
        out += re.sub(r"([\\`*_<>\[\]|{}])", r"\\\1", plain(rest))
    return out


def page(manual):
    """A manual page as Markdown; its first line is the heading."""
    name = manual.stem.replace("-", " ")
    out, about, lines = [], "", manual.read_text().splitlines()
    section, at = "", 0
    while at < len(lines):
        line = lines[at]
        at += 1
        if line.startswith(".SH "):
            section = line[4:]
            if section not in ("NAME", "SEE ALSO"):
                out += ["", "## " + section.capitalize(), ""]
        elif line == ".TP":
            term = lines[at].removeprefix(".B ")
            at += 1
            text = []
            while at < len(lines) and not re.match(r"\.(TP|SH)", lines[at]):
                text.append(markdown(lines[at]))
                at += 1
            out += [markdown(term), ": " + " ".join(text), ""]
        elif section == "NAME":
            about = markdown(line.split(r" \- ", 1)[1])
        elif section not in ("", "SEE ALSO") and line:
            out.append(markdown(line))
    text = "\n".join([f"# {name}", "", about + ("" if about.endswith(".") else "."), *out]) + "\n"
    # "See palpate-motion(1)." becomes a link.
    return re.sub(r"`(palpate[a-z-]*)`\(1\)", r"[\1](\1.md)", text), about


def main():
    manuals, folder = sorted(Path(sys.argv[1]).glob("*.1")), Path(sys.argv[2])
    whole = ""
    for manual in manuals:
        text, _ = page(manual)
        if manual.stem == "palpate":
            whole = text
        else:
            (folder / (manual.stem + ".md")).write_text(text)
    others = "\n".join(manual.stem for manual in manuals if manual.stem != "palpate")
    (folder / "palpate.md").write_text(whole + f"\n```{{toctree}}\n:hidden:\n\n{others}\n```\n")


main()
