"""The table and the page of a cohort: from the status.json of its sequences, and from what is known of those without one."""

import csv
import html
import io
import json
import os
import signal
import statistics
from pathlib import Path

# Columns of the page after the verdict, which narrow windows show as lines.
COLUMNS = ("frames", "motion, mean / most, mm", "local correlation", "motion left, voxels", "voxels that fold", "least determinant", "seconds")
NUMBERS = ("model", "frames", "size", "spacing_mm", "motion_mean_mm", "motion_max_mm", "folded_voxels", "least_determinant",
           "correlation_before", "correlation_after", "motion_left_voxels", "solve_seconds", "seconds", "attempt", "host", "device")
WORST_FIRST = ("lost", "unusable", "failed", "left", "suspect", "ok")
MEANING = {"ok": "no check found anything", "suspect": "a person should look at the fields before using them",
           "failed": "the fields must not be used", "unusable": "palpate can not use the files",
           "lost": "its job was killed, or its machine failed, each time", "left": "not done yet: run the same again"}

STYLE = """
body { font: 15px/1.45 Inter, system-ui, sans-serif; margin: 2rem auto; max-width: 72rem; padding: 0 1rem; color: #1b2230; background: #fff }
h1 { font-size: 1.5rem } table { border-collapse: collapse; width: 100% } th, td { text-align: right; padding: .35rem .6rem; border-bottom: 1px solid #dfe3ea; vertical-align: top }
th:first-child, td:first-child, .text { text-align: left } th { hyphens: auto } td { overflow-wrap: anywhere } td.text { min-width: 9rem }
.table { overflow-x: auto } td a { overflow-wrap: anywhere } img { width: 11rem; max-width: 100%; border-radius: 4px } .state { font-weight: 600 }
.ok { color: #1a7f4b } .suspect, .left { color: #9a6700 } .failed, .unusable, .lost { color: #b3261e } .quiet { color: #667085 }
@media (max-width: 44rem) { body { margin: 1rem auto } thead { display: none } table, tbody, tr, td { display: block } tr { border-bottom: 1px solid #dfe3ea; padding: .6rem 0 } td, td.text { border: 0; padding: .1rem 0; text-align: left; min-width: 0 } td[data-of]::before { content: attr(data-of) ": "; color: #667085 } td br { display: none } td:first-child br, td.text br { display: inline } td .quiet::before { content: " " } }
@media (prefers-color-scheme: dark) { body { background: #14181f; color: #e4e8ef } th, td { border-color: #2c3440 } .ok { color: #55c98b } .suspect, .left { color: #e0b04c } .failed, .unusable, .lost { color: #ff8a80 } .quiet, td[data-of]::before { color: #98a2b3 } tr { border-color: #2c3440 } a { color: #8ab4f8 } }
"""


def text(value, digits: int = 2) -> str:
    if value is None:
        return "-"
    return f"{value:.{digits}f}" if isinstance(value, float) else html.escape(str(value))


def cell(value) -> str:
    """A number in the table: as many digits as mean something."""
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def row(one: dict) -> str:
    name = html.escape(one["name"])
    picture = f'<a href="{name}/picture.png"><img src="{name}/picture.png" alt="{name}"></a>' if one.get("picture") else ""
    scrolled = f'<a href="{name}/page.html">page</a> ' if one.get("page") else ""
    log = "" if one["state"] == "left" else f'<a class="quiet" href="{name}/log.txt">log</a><br>'
    reasons = "<br>".join(html.escape(r) for r in one.get("reasons", []))
    motion = f"{text(one.get('motion_mean_mm'))} / {text(one.get('motion_max_mm'), 1)}"
    match = f"{text(one.get('correlation_before'), 3)} &rarr; {text(one.get('correlation_after'), 3)}"
    numbers = (f'{text(one.get("frames"))}<br><span class="quiet">{text(one.get("size"))}</span>', motion, match, text(one.get("motion_left_voxels")),
               text(one.get("folded_voxels")), text(one.get("least_determinant")), text(one.get("seconds"), 1))
    cells = "".join(f'<td data-of="{column}">{number}</td>' for column, number in zip(COLUMNS, numbers))
    return (f'<tr><td><b>{name}</b><br>{scrolled}{log}{picture}</td>'
            f'<td class="text"><span class="state {one["state"]}">{one["state"]}</span><br>{reasons}</td>{cells}</tr>')


def page(all_of: list[dict]) -> str:
    counts = {state: sum(one["state"] == state for one in all_of) for state in WORST_FIRST}
    said = [f'<li><span class="state {state}">{counts[state]} {state}</span>: {MEANING[state]}</li>'
            for state in reversed(WORST_FIRST) if counts[state]]
    times = [one["seconds"] for one in all_of if one["state"] not in ("unusable", "lost", "left")]
    spent = (f"<p>A sequence took {statistics.median(times):.1f} s in the median, {max(times):.1f} s at most; "
             f"{sum(times) / 3600:.2f} hours of work in all.</p>" if times else "")
    rows = "".join(row(one) for one in sorted(all_of, key=lambda one: (WORST_FIRST.index(one["state"]), one["name"])))
    heads = "".join(f"<th>{column}</th>" for column in COLUMNS)
    return (f'<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
            f'<title>Cohort</title><style>{STYLE}</style></head><body>'
            f"<h1>Motion of {len(all_of)} sequences</h1><ul>{''.join(said)}</ul>{spent}"
            "<p>The worst come first. Of a sequence each number is that of its worst frame. The same numbers are in "
            '<a href="cohort.csv">cohort.csv</a>.</p><div class="table"><table><thead><tr><th>sequence</th><th class="text">verdict</th>'
            f"{heads}</tr></thead><tbody>{rows}</tbody></table></div></body></html>\n")


def attempts_of(folder: Path) -> list[dict]:
    """Per attempt without an answer: attempt, host, job; then ended, exit and slurm as far as somebody was left to note them."""
    try:
        lines = (folder / "attempts.jsonl").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return []
    attempts = []
    for line in lines:
        try:
            noted = json.loads(line)
        except ValueError:
            # Who wrote it was killed meanwhile.
            continue
        # A job that did not get as far as to note its attempt is one, too.
        jobs = {one.get("job") for one in (noted, *attempts[-1:])} - {None}
        if not attempts or "attempt" in noted or (noted.keys() - {"job"}) & attempts[-1].keys() or len(jobs) > 1:
            attempts.append({})
        attempts[-1].update(noted)
    return attempts


def reason(one: dict) -> str:
    """An attempt as a sentence."""
    known = []
    if "ended" in one:
        known.append(one["ended"])
    elif "exit" in one:
        # As shells say it.
        number = one["exit"] - 128
        by = f", signal {number} ({signal.strsignal(number)})" if number in signal.valid_signals() else ""
        known.append(f"its process ended with exit status {one['exit']}{by}")
    if "slurm" in one:
        known.append(f"Slurm says {one['slurm']} of job {one['job']}")
    begun = f"Attempt {one['attempt']} on {one['host']}" if "attempt" in one else "An attempt"
    return f"{begun}: {'; '.join(known) or 'killed, or its machine failed, before anything could be noted'}."


def status_of(output: Path, asked: dict) -> dict:
    """How a sequence ended, or that it is left."""
    folder = output / asked["name"]
    try:
        return json.loads((folder / "status.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        attempts = attempts_of(folder)
        last = next((one for one in reversed(attempts) if "attempt" in one), {})
        return {"name": asked["name"], "state": "left", "attempt": last.get("attempt"), "host": last.get("host"),
                "reasons": [reason(one) for one in attempts]}


def give_up(output: Path, asked: dict, retries: int) -> None:
    """A sequence whose last attempt has ended without an answer is lost: only --retry tries it again."""
    status = status_of(output, asked)
    if status["state"] == "left" and (status["attempt"] or 0) > retries:
        write(output / asked["name"] / "status.json", json.dumps(dict(status, state="lost", asked=asked), indent=1))


def write(path: Path, text: str) -> None:
    """As a whole or not at all: until then what stood there stays."""
    new = path.with_name(path.name + ".new")
    new.write_text(text, encoding="utf-8", newline="")
    os.replace(new, path)


def report(output: Path, sequences: list[dict]) -> dict[str, list[str]]:
    """Writes table and page, and returns the names of the sequences by state."""
    all_of = [status_of(output, asked) for asked in sequences]
    table = io.StringIO(newline="")
    writer = csv.writer(table)
    writer.writerow(("name", "state", *NUMBERS, "reasons"))
    for one in all_of:
        writer.writerow((one["name"], one["state"], *(cell(one.get(key)) for key in NUMBERS),
                         " ".join(one.get("reasons", []))))
    write(output / "cohort.csv", table.getvalue())
    write(output / "cohort.html", page(all_of))
    return {state: names for state in reversed(WORST_FIRST) if (names := [one["name"] for one in all_of if one["state"] == state])}
