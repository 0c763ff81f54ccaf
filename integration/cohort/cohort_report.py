"""The table and the page of a cohort, from the status.json of its sequences."""

import argparse
import csv
import html
import json
import statistics
from pathlib import Path

NUMBERS = ("model", "frames", "size", "spacing_mm", "motion_mean_mm", "motion_max_mm", "folded_voxels", "least_determinant",
           "correlation_before", "correlation_after", "motion_left_voxels", "solve_seconds", "seconds", "attempt", "host", "device")
WORST_FIRST = ("lost", "unusable", "failed", "suspect", "ok")
MEANING = {"ok": "no check found anything", "suspect": "a person should look at the fields before using them",
           "failed": "the fields must not be used", "unusable": "palpate can not use the files",
           "lost": "the machine lost it each time"}

STYLE = """
body { font: 15px/1.45 Inter, system-ui, sans-serif; margin: 2rem auto; max-width: 72rem; padding: 0 1rem; color: #1b2230; background: #fff }
h1 { font-size: 1.5rem } table { border-collapse: collapse; width: 100% } th, td { text-align: right; padding: .35rem .6rem; border-bottom: 1px solid #dfe3ea; vertical-align: top }
th:first-child, td:first-child, .text { text-align: left } img { width: 11rem; border-radius: 4px } .state { font-weight: 600 }
.ok { color: #1a7f4b } .suspect { color: #9a6700 } .failed, .unusable, .lost { color: #b3261e } .quiet { color: #667085 }
@media (prefers-color-scheme: dark) { body { background: #14181f; color: #e4e8ef } th, td { border-color: #2c3440 } .ok { color: #55c98b } .suspect { color: #e0b04c } .failed, .unusable, .lost { color: #ff8a80 } .quiet { color: #98a2b3 } a { color: #8ab4f8 } }
"""


def text(value, digits: int = 2) -> str:
    if value is None:
        return "-"
    return f"{value:.{digits}f}" if isinstance(value, float) else html.escape(str(value))


def row(one: dict) -> str:
    name = html.escape(one["name"])
    picture = f'<a href="{name}/picture.png"><img src="{name}/picture.png" alt="{name}"></a>' if one.get("picture") else ""
    reasons = "<br>".join(html.escape(r) for r in one.get("reasons", []))
    motion = f"{text(one.get('motion_mean_mm'))} / {text(one.get('motion_max_mm'), 1)}"
    match = f"{text(one.get('correlation_before'), 3)} &rarr; {text(one.get('correlation_after'), 3)}"
    return (f'<tr><td><b>{name}</b><br><a class="quiet" href="{name}/log.txt">log</a><br>{picture}</td>'
            f'<td class="text"><span class="state {one["state"]}">{one["state"]}</span><br>{reasons}</td>'
            f'<td>{text(one.get("frames"))}<br><span class="quiet">{text(one.get("size"))}</span></td><td>{motion}</td><td>{match}</td>'
            f'<td>{text(one.get("motion_left_voxels"))}</td><td>{text(one.get("folded_voxels"))}</td>'
            f'<td>{text(one.get("least_determinant"))}</td><td>{text(one.get("seconds"), 1)}</td></tr>')


def page(all_of: list[dict]) -> str:
    counts = {state: sum(one["state"] == state for one in all_of) for state in WORST_FIRST}
    said = [f'<li><span class="state {state}">{counts[state]} {state}</span>: {MEANING[state]}</li>'
            for state in reversed(WORST_FIRST) if counts[state]]
    times = [one["seconds"] for one in all_of if one["state"] not in ("unusable", "lost")]
    spent = (f"<p>A sequence took {statistics.median(times):.1f} s in the median, {max(times):.1f} s at most; "
             f"{sum(times) / 3600:.2f} hours of work in all.</p>" if times else "")
    rows = "".join(row(one) for one in sorted(all_of, key=lambda one: (WORST_FIRST.index(one["state"]), one["name"])))
    return (f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Cohort</title><style>{STYLE}</style></head><body>'
            f"<h1>Motion of {len(all_of)} sequences</h1><ul>{''.join(said)}</ul>{spent}"
            "<p>The worst come first. Of a sequence each number is that of its worst frame. The same numbers are in "
            '<a href="cohort.csv">cohort.csv</a>.</p><table><thead><tr><th>sequence</th><th class="text">verdict</th><th>frames</th>'
            "<th>motion, mean / most, mm</th><th>local correlation</th><th>motion left, voxels</th><th>voxels that fold</th>"
            f"<th>least determinant</th><th>seconds</th></tr></thead><tbody>{rows}</tbody></table></body></html>\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("status", nargs="+", type=Path)
    parser.add_argument("--table", type=Path, required=True)
    parser.add_argument("--page", type=Path, required=True)
    options = parser.parse_args()
    all_of = [json.loads(path.read_text()) for path in options.status]
    with open(options.table, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("name", "state", *NUMBERS, "reasons"))
        for one in all_of:
            writer.writerow((one["name"], one["state"], *("" if one.get(key) is None else one[key] for key in NUMBERS),
                             " ".join(one.get("reasons", []))))
    options.page.write_text(page(all_of), encoding="utf-8")


if __name__ == "__main__":
    main()
