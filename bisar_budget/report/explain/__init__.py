"""Explanations of the status of a row: equations with numbers, and the typesetting of the equations."""
