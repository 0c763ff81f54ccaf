#pragma once

namespace palpate::report {

/// The page's style sheet. One column of text; pictures have its width, or scroll sideways where
/// they would be too small to read; prints well. Dark if the system is: the figures' colours
/// (plot.py) are selected by their style attributes, as matplotlib writes them.
inline constexpr const char* kPageStyle = R"css(
:root { color-scheme: light dark; --paper: #fff; --veil: #ffffffee; --ink: #222; --quiet: #555; --line: #ddd;
  --link: #0060a0; --plate: #f5f6f8; --good: #f1f8f5; --bad: #fdf3ec; }
@media (prefers-color-scheme: dark) {
  :root { --paper: #14171c; --veil: #14171cee; --ink: #e8eaed; --quiet: #a9afb8; --line: #383e47;
    --link: #7cbcf0; --plate: #1e232a; --good: #16261f; --bad: #2c1d13; }
  [style*="fill: #ffffff"] { fill: #14171c !important; }
  [style*="stroke: #ffffff"] { stroke: #14171c !important; }
  [style*="fill: #222222"] { fill: #e8eaed !important; }
  [style*="stroke: #222222"] { stroke: #e8eaed !important; }
  [style*="fill: #666666"] { fill: #a9afb8 !important; }
  [style*="stroke: #666666"] { stroke: #a9afb8 !important; }
  [style*="stroke: #e8e8e8"] { stroke: #2b3038 !important; }
  [style*="fill: #d9d9d9"] { fill: #474d57 !important; }
  [style*="stroke: #d9d9d9"] { stroke: #474d57 !important; }
  [style*="fill: #0072b2"] { fill: #4aa8e0 !important; }
  [style*="stroke: #0072b2"] { stroke: #4aa8e0 !important; }
  [style*="fill: #555555"] { fill: #aeb3bb !important; }
  [style*="stroke: #555555"] { stroke: #aeb3bb !important; }
  [style*="fill: #882255"] { fill: #d9709f !important; }
  [style*="stroke: #882255"] { stroke: #d9709f !important; }
}
body { margin: 0 auto; max-width: 58rem; padding: 1.5rem 1.25rem 5rem; background: var(--paper); color: var(--ink);
  font: 16px/1.5 Inter, system-ui, "Segoe UI", Helvetica, Arial, sans-serif; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: .5rem 0 .75rem; letter-spacing: -.01em; }
h2 { font-size: 1.35rem; margin: 3.25rem 0 .75rem; padding-top: 1rem; border-top: 2px solid var(--ink); }
h3 { font-size: 1.02rem; margin: 2rem 0 .5rem; }
h1, h2, h3, p { overflow-wrap: anywhere; }
p { margin: .6rem 0; max-width: 46rem; }
a { color: var(--link); }
dl { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(16rem, 100%), 1fr)); gap: .5rem 1.5rem;
  margin: 1.25rem 0; padding: .9rem 1.1rem; background: var(--plate); border-radius: 6px; font-size: .88rem; }
dt { color: var(--quiet); } dd { margin: 0; font-weight: 500; overflow-wrap: anywhere; }
nav { position: sticky; top: 0; display: flex; flex-wrap: wrap; gap: .25rem 1.25rem; padding: .6rem 0;
  background: var(--veil); border-bottom: 1px solid var(--line); font-size: .92rem; z-index: 1; }
nav a { text-decoration: none; }
section { scroll-margin-top: 2.5rem; }
.answer { border-left: 4px solid #009E73; background: var(--good); padding: .5rem 1.1rem; margin: 1rem 0 1.5rem;
  border-radius: 0 6px 6px 0; font-size: 1.04rem; }
.grave { border-left: 4px solid #D55E00; background: var(--bad); padding: .6rem 1.1rem; border-radius: 0 6px 6px 0; }
.note, figcaption { color: var(--quiet); font-size: .88rem; }
figure { margin: 1.5rem 0 2rem; } figure h3 { margin-bottom: .25rem; }
figure svg { display: block; width: 100%; min-width: 46rem; height: auto; }
figcaption { max-width: 46rem; margin-top: .25rem; }
.csv { white-space: nowrap; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .86rem; font-variant-numeric: tabular-nums; }
th, td { padding: .28rem .75rem .28rem 0; text-align: left; border-bottom: 1px solid var(--line); vertical-align: top; }
th { border-bottom: 1.5px solid var(--quiet); font-weight: 600; vertical-align: bottom; }
th.n, td.n { text-align: right; padding-left: .5rem; white-space: nowrap; }
details { margin: 1rem 0; } summary { cursor: pointer; font-weight: 600; font-size: 1.02rem; }
@media print { nav { position: static; } figure, tr { break-inside: avoid; } figure svg { min-width: 0; } }
)css";

}  // namespace palpate::report
