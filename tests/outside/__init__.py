"""The package against what others wrote: their processors, their printed figures, their data.

Each comparison is recorded (`record.compare`); the page "Checked from outside" of the documentation shows them all.
"""
