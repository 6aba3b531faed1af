"""The compliance report. Its content is a list of blocks, which are written as an HTML page or as Markdown."""
