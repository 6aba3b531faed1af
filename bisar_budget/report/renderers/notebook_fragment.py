"""Write a document as an HTML fragment for a notebook, in the colours of the notebook's theme."""

from bisar_budget import notebook
from bisar_budget.findings.status import STATUS
from bisar_budget.report import document as doc
from bisar_budget.report.renderers.html import blocks_as_html

_STATUS_TONES = "".join(
    f".bisar-budget .{status.name} {{ --tone: var(--{status.color}) }}\n" for status in STATUS.values()
)  # a status has the same colour as on a page


def fragment(document: doc.AnswerDocument) -> str:
    """Write the chapters of a document as an HTML fragment that contains its own style sheet."""
    chapters = (f"{blocks_as_html(chapter.blocks)}" for chapter in document.chapters)
    return notebook.page(f"<style>{_STATUS_TONES}</style>", *chapters)
