"""The compliance report: its content as blocks, which are written as a page and as Markdown."""
