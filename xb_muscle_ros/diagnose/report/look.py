"""The page's style sheet: quiet on a screen, A4 on paper, nothing told by colour alone."""

from __future__ import annotations

STYLE = """
:root { color-scheme: light; --ink: #1b1b1b; --soft: #5d5d5d; --rule: #cfcfcf; --tint: #f4f6f9; --accent: #0b4f8a;
  --sans: "Helvetica Neue", Helvetica, Arial, "Liberation Sans", "DejaVu Sans", sans-serif; }
* { box-sizing: border-box; }
html { background: #fff; }
body { margin: 0 auto; padding: 2.4rem 1rem 4rem; max-width: 44rem; color: var(--ink);
  font: 1rem/1.5 Charter, "Bitstream Charter", Georgia, "Liberation Serif", "Times New Roman", serif;
  overflow-wrap: anywhere; }
header p, nav, th, td, caption, figcaption, dl, .kicker, .facts, .list, footer { font-family: var(--sans); }
header p { margin: 0; font-size: .8rem; color: var(--soft); }
h1 { margin: .15rem 0 .3rem; font-size: 1.9rem; line-height: 1.2; font-weight: 600; }
h2 { margin: 2.6rem 0 .6rem; padding-top: .5rem; border-top: 1px solid var(--rule); font-size: 1.2rem; line-height: 1.3;
  font-weight: 600; break-after: avoid; }
h2 + p { break-after: avoid; }
h3 { margin: 1.2rem 0 .3rem; font-size: 1rem; font-weight: 600; break-after: avoid; }
p { margin: .5rem 0; }
sub { font-size: .7em; line-height: 0; }
code { font-family: ui-monospace, Menlo, Consolas, "DejaVu Sans Mono", monospace; font-size: .84em; }
.lead { margin: 1.4rem 0 1.6rem; font-size: 1.1rem; line-height: 1.55; }
a { color: var(--accent); text-decoration: none; }
a:hover { text-decoration: underline; }
a.n { color: inherit; white-space: nowrap; border-bottom: 1px dotted #b5b5b5; }
td a.n { border-bottom: 0; }
a.n:hover { color: var(--accent); text-decoration: none; border-bottom: 1px solid var(--accent); }
:target { background: #fff6d6; }
nav { margin: .9rem 0 0; font-size: .8rem; color: var(--soft); }
nav a { margin-right: .9em; white-space: nowrap; }
.verdict { padding: 1rem 1.2rem .9rem; border: 1px solid var(--rule); border-left: .35rem solid var(--ink);
  background: var(--tint); break-inside: avoid; }
.kicker { margin: 0; font-size: .72rem; letter-spacing: .08em; text-transform: uppercase; color: var(--soft); }
.verdict h2 { margin: .1rem 0 .3rem; padding: 0; border: 0; font-size: 1.35rem; }
.facts { display: flex; flex-wrap: wrap; gap: .6rem 1.4rem; margin: .9rem 0 .1rem; font-size: .8rem;
  color: var(--soft); }
.facts b { display: block; font-size: 1.05rem; font-weight: 600; color: var(--ink); }
.list { margin: .3rem 0; padding: 0; list-style: none; font-size: .86rem; }
.list li { padding: .22rem 0 .22rem 5.2rem; text-indent: -5.2rem; border-bottom: 1px solid #ececec;
  break-inside: avoid; }
.mark { display: inline-block; width: 5.2rem; text-indent: 0; font-weight: 600; }
.plain li { padding-left: 1.2rem; text-indent: -1.2rem; }
.plain li::before { content: "–"; display: inline-block; width: 1.2rem; text-indent: 0; }
.next { padding: .1rem 1.2rem .4rem; border-left: .35rem solid var(--accent); break-inside: avoid; }
figure { margin: 1.2rem 0 1.6rem; break-inside: avoid; }
figure img { display: block; max-width: 100%; height: auto; margin: 0 auto; }
figcaption { margin-top: .4rem; font-size: .78rem; line-height: 1.42; color: #333; }
table { width: 100%; margin: 1.1rem 0 1.5rem; border-collapse: collapse; font-size: .76rem; line-height: 1.32;
  font-variant-numeric: tabular-nums; }
caption { padding-bottom: .4rem; text-align: left; font-size: .78rem; line-height: 1.42; color: #333;
  break-after: avoid; }
thead { display: table-header-group; break-after: avoid; }
tbody tr:first-child { break-before: avoid; }
th, td { overflow-wrap: normal; padding: .26rem .5rem .26rem 0; vertical-align: top; text-align: left; }
th { border-top: 1px solid var(--ink); border-bottom: 1px solid var(--ink); font-weight: 600; vertical-align: bottom; }
tr { break-inside: avoid; }
tbody tr { border-bottom: 1px solid #ececec; }
tbody tr:last-child { border-bottom: 1px solid var(--ink); }
th.r, td.r { padding: .26rem 0 .26rem .5rem; text-align: right; }
.any { overflow-wrap: anywhere; }
td small { display: block; color: var(--soft); font-size: .94em; }
tr.answer td:first-child { font-weight: 600; }
tr.answer small { font-weight: 400; }
tr.left-out td, tr.left-out small { color: #767676; }
dl { font-size: .8rem; line-height: 1.42; }
dl div { display: grid; grid-template-columns: 12rem 1fr; gap: 0 1rem; padding: .3rem; border-bottom: 1px solid #ececec;
  break-inside: avoid; }
dt { font-weight: 600; }
dd { margin: 0; }
footer { margin-top: 2.4rem; padding-top: .6rem; border-top: 1px solid var(--rule); font-size: .76rem;
  color: var(--soft); }
@page { size: A4; margin: 15mm 16mm 16mm;
  @bottom-right { content: counter(page); font: 8pt sans-serif; color: #5d5d5d; } }
@media (max-width: 36rem) { dl div { display: block; } table { font-size: .66rem; } }
@media print {
  html { font-size: 10pt; }
  body { max-width: none; padding: 0; }
  nav { display: none; }
  a, a.n { color: inherit; border-bottom: 0; }
  .verdict, .next { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
  h2 { margin-top: 1.3rem; }
  .lead { margin: .8rem 0 1rem; font-size: 1.04rem; line-height: 1.45; }
  .verdict { padding: .7rem 1rem .6rem; }
  .next { padding-left: 1rem; }
  h3 { margin-top: .8rem; }
  :target { background: none; }
}
"""
