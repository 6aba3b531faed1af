"""The compliance report: what it shows, as plain data for the templates."""
