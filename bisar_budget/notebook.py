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
.bisar-budget .status { display: inline-block; padding: 0 0.5em; border-radius: 0.3em; color: #fff; font-weight: 600 }
.bisar-budget .muted { opacity: 0.7 }
.bisar-budget svg, .bisar-budget img { max-width: 100%; height: auto }
</style>"""
# White text on each colour has a contrast of at least 4.5, on light and on dark pages.
_COLOURS = {
    "pass": "#1a7f37",
    "pass_with_autofocus": "#1a7f37",
    "waived": "#8a5a00",
    "info": "#57606a",
    "not_declared": "#57606a",
    "warn": "#8a5a00",
    "not_evaluated": "#8250df",
    "fail": "#c0272d",
    "error": "#c0272d",
}


def page(*elements: str) -> str:
    """HTML of a result, which consists of a style sheet and the given elements."""
    return f'{_NOTEBOOK_STYLE}<div class="bisar-budget">{"".join(elements)}</div>'


def heading(status: str, title: str, remark: str = "") -> str:
    """HTML of a heading: the verdict `status`, the title of the result, and a remark in paler text."""
    texts = f' <span class="muted">{escape(remark)}</span>' if remark else ""
    return f"<p>{badge(status)} <strong>{escape(title)}</strong>{texts}</p>"


def badge(status: str) -> str:
    """HTML of a status on a background in the colour of the status."""
    colour = _COLOURS.get(status, "#57606a")
    return f'<span class="status" style="background: {colour}">{escape(status.replace("_", " "))}</span>'


def table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """HTML table; the values of a column `status` are badges, and numbers are aligned to the right."""
    head = "".join(f"<th>{escape(name)}</th>" for name in columns)
    body = "".join(f"<tr>{''.join(map(_cell, columns, row))}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _cell(column: str, value: object) -> str:
    if column == "status" and isinstance(value, str):
        return f"<td>{badge(value)}</td>"
    if isinstance(value, int | float):
        return f'<td class="number">{value:.4g}</td>'
    return f"<td>{'' if value is None else escape(str(value))}</td>"


def note(text: str) -> str:
    """HTML of a line of text below the result."""
    return f'<p class="muted">{escape(text)}</p>'
