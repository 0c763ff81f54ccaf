"""Writes the manual page of palpate-cohort (man1) and its completions (bash, zsh) into a folder, from the definition of its options.

usage: write_manual.py VERSION FOLDER
"""

import argparse
import importlib.machinery
import importlib.util
import sys
from pathlib import Path

# The source tree stays as it is.
sys.dont_write_bytecode = True
NAME = "palpate-cohort"


def definition() -> argparse.ArgumentParser:
    # Its name is that of a program, not of a module.
    loader = importlib.machinery.SourceFileLoader("palpate_cohort", str(Path(__file__).resolve().parent / NAME))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module.parser_of_options()


def value_of(option: argparse.Action) -> str:
    """What stands behind an option; empty where nothing does."""
    if option.nargs == 0:
        return ""
    return option.metavar or (",".join(option.choices) if option.choices else option.dest.upper())


def is_path(option: argparse.Action) -> bool:
    return option.metavar in ("FILE", "DIR") or option.type is Path


def roff(text: str) -> str:
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq")
    return "\\&" + text if text.startswith(".") else text


def man_page(parser: argparse.ArgumentParser, version: str) -> str:
    usage = parser.format_usage().split(NAME, 1)[1]
    text = f'.TH "{NAME}" "1" "" "palpate {version}" "palpate"\n.SH NAME\n{roff(NAME)} \\- {roff(parser.description.rstrip("."))}\n'
    text += f".SH SYNOPSIS\n\\fB{roff(NAME)}\\fR {roff(' '.join(usage.split()))}\n.SH DESCRIPTION\n{roff(parser.epilog)}\n.SH OPTIONS\n"
    for option in parser._actions:
        spelled = ", ".join(f"\\fB{roff(name)}\\fR" for name in option.option_strings) or f"\\fI{roff(option.dest)}\\fR"
        value = f" \\fI{roff(value_of(option))}\\fR" if option.option_strings and value_of(option) else ""
        text += f".TP\n{spelled}{value}\n{roff(option.help)}\n"
    return text + ".SH SEE ALSO\n\\fBpalpate\\fR(1), \\fBpalpate\\-motion\\fR(1)\n"


def bash_completion(parser: argparse.ArgumentParser) -> str:
    cases = ""
    for option in parser._actions:
        if option.option_strings and value_of(option):
            offered = f"-W '{' '.join(option.choices)}'" if option.choices else "-d" if option.metavar == "DIR" else \
                "-f" if is_path(option) else ""
            then = f"words={offered}" if offered in ("-d", "-f") else \
                f"mapfile -t COMPREPLY < <(compgen {offered} -- \"$cur\"); return" if offered else "return"
            cases += f"    {' | '.join(option.option_strings)}) {then} ;;\n"
    names = " ".join(name for option in parser._actions for name in option.option_strings)
    return f"""# bash completion for {NAME}, made from the definition of its options.
_palpate_cohort() {{
  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD - 1]}} words=-f
  COMPREPLY=()
  # bash takes the '=' of --option=value for a word.
  if [[ $cur == = ]]; then cur=; elif [[ $prev == = ]]; then prev=${{COMP_WORDS[COMP_CWORD - 2]}}; fi
  case $prev in
{cases}  esac
  if [[ $cur == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W '{names}' -- "$cur")
  else
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen $words -- "$cur")
  fi
}}
complete -F _palpate_cohort {NAME}
"""


def zsh_completion(parser: argparse.ArgumentParser) -> str:
    def quoted(text: str) -> str:
        for one in "\\[]:":
            text = text.replace(one, "\\" + one)
        return text.replace("'", "'\\''")

    lines = []
    for option in parser._actions:
        value = "" if not value_of(option) else f":value:({' '.join(option.choices)})" if option.choices else \
            ":folder:_files -/" if option.metavar == "DIR" else ":file:_files" if is_path(option) else ":value:"
        lines += [f"'*{name}[{quoted(option.help)}]{value}'" for name in option.option_strings] or [f"'*{value}'"]
    return f"#compdef {NAME}\n# Made from the definition of its options.\n_arguments " + " \\\n  ".join(lines) + "\n"


def main() -> None:
    version, folder = sys.argv[1], Path(sys.argv[2])
    parser = definition()
    for name, text in ((f"man1/{NAME}.1", man_page(parser, version)), (f"bash/{NAME}", bash_completion(parser)),
                       (f"zsh/_{NAME}", zsh_completion(parser))):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
