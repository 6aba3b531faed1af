"""HTML for a notebook: tables and drawings of results, in the colours of the notebook's theme."""

from collections.abc import Iterable, Sequence
from html import escape

_NOTEBOOK_STYLE = """<style>
.bisar-budget { overflow-x: auto; font-size: 0.92em; line-height: 1.35 }
.bisar-budget table { border-collapse: collapse; margin: 0.4em 0 }
.bisar-budget th, .bisar-budget td { padding: 0.15em 0.7em; text-align: left; background: transparent }
.bisar-budget td:not(:last-child) { white-space: nowrap }
.bisar-budget thead th { border-bottom: 1px solid currentColor; font-weight: 600 }
.bisar-budget td.number { text-align: right; font-variant-numeric: tabular-nums }
.bisar-budget { --fail: #c0272d; --doubt: #8a5a00; --pass: #1a7f37; --mission: #57606a }
.bisar-budget .status { display: inline-block; padding: 0 0.5em; border-radius: 0.3em; color: #fff; font-weight: 600 }
.bisar-budget .status { background: var(--tone, var(--mission)) }
.bisar-budget .verdict { font-weight: 600; border-left: 0.3em solid var(--tone, var(--mission)); padding-left: 0.5em }
.bisar-budget dl { margin: 0.4em 0 }
.bisar-budget dl div { display: flex; gap: 1em }
.bisar-budget dt { min-width: 7em; opacity: 0.7; font-weight: 400 }
.bisar-budget dd { margin: 0 }
.bisar-budget caption { text-align: left; opacity: 0.7 }
.bisar-budget figure { margin: 0.4em 0 }
.bisar-budget svg.use { width: 8em; height: 0.6em; margin-left: 0.6em }
.bisar-budget svg .track { fill: currentColor; opacity: 0.15 }
.bisar-budget svg .fill, .bisar-budget svg .break { fill: var(--tone, var(--mission)) }
.bisar-budget svg .limit { stroke: currentColor }
.bisar-budget .muted { opacity: 0.7 }
.bisar-budget svg, .bisar-budget img { max-width: 100%; height: auto }
</style>"""


def page(*elements: str) -> str:
    """HTML of a result: a style sheet, followed by the given elements."""
    return f'{_NOTEBOOK_STYLE}<div class="bisar-budget">{"".join(elements)}</div>'


def table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """HTML table in which numbers are aligned to the right."""
    head = "".join(f"<th>{escape(name)}</th>" for name in columns)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _cell(value: object) -> str:
    if isinstance(value, int | float):
        return f'<td class="number">{value:.4g}</td>'
    return f"<td>{'' if value is None else escape(str(value))}</td>"


def note(text: str) -> str:
    """HTML of a line of small print below a result."""
    return f'<p class="muted">{escape(text)}</p>'
