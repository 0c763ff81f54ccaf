#pragma once

namespace palpate::report {

/// The page's style sheet. One column of text, pictures as wide as it; prints on paper as it is.
inline constexpr const char* kPageStyle = R"(
:root { color-scheme: light; }
body { margin: 0 auto; max-width: 58rem; padding: 1.5rem 1.25rem 5rem; background: #fff; color: #222;
  font: 16px/1.5 Inter, system-ui, "Segoe UI", Helvetica, Arial, sans-serif; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: .5rem 0 .75rem; letter-spacing: -.01em; }
h2 { font-size: 1.35rem; margin: 3.25rem 0 .75rem; padding-top: 1rem; border-top: 2px solid #222; }
h3 { font-size: 1.02rem; margin: 2rem 0 .5rem; }
p { margin: .6rem 0; max-width: 46rem; }
a { color: #0060a0; }
dl { display: grid; grid-template-columns: repeat(auto-fill, minmax(16rem, 1fr)); gap: .5rem 1.5rem;
  margin: 1.25rem 0; padding: .9rem 1.1rem; background: #f5f6f8; border-radius: 6px; font-size: .88rem; }
dt { color: #666; } dd { margin: 0; font-weight: 500; overflow-wrap: anywhere; }
nav { position: sticky; top: 0; display: flex; flex-wrap: wrap; gap: .25rem 1.25rem; padding: .6rem 0;
  background: #ffffffee; border-bottom: 1px solid #ddd; font-size: .92rem; }
nav a { text-decoration: none; }
section { scroll-margin-top: 2.5rem; }
.answer { border-left: 4px solid #009E73; background: #f1f8f5; padding: .5rem 1.1rem; margin: 1rem 0 1.5rem;
  border-radius: 0 6px 6px 0; font-size: 1.04rem; }
.grave { border-left: 4px solid #D55E00; background: #fdf3ec; padding: .6rem 1.1rem; border-radius: 0 6px 6px 0; }
.note, figcaption { color: #555; font-size: .88rem; }
figure { margin: 1.5rem 0 2rem; } figure h3 { margin-bottom: .25rem; }
figure svg { display: block; width: 100%; height: auto; }
figcaption { max-width: 46rem; margin-top: .25rem; }
.csv { white-space: nowrap; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .86rem; font-variant-numeric: tabular-nums; }
th, td { padding: .28rem .75rem .28rem 0; text-align: left; border-bottom: 1px solid #e6e6e6; vertical-align: top; }
th { border-bottom: 1.5px solid #888; font-weight: 600; vertical-align: bottom; }
th.n, td.n { text-align: right; padding-left: .5rem; white-space: nowrap; }
details { margin: 1rem 0; } summary { cursor: pointer; font-weight: 600; font-size: 1.02rem; }
@media print { nav { position: static; } figure, tr { break-inside: avoid; } }
)";

}  // namespace palpate::report
