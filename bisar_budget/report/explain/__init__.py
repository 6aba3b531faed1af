"""Explanations of how the status of a row follows: its equations with their numbers, and their typesetting."""
