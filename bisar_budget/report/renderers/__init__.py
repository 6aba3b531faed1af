"""Renderers of documents, one for each format: text for a terminal, Markdown, HTML, and a workbook."""
