"""Explanations of the status of a row: equations with their numbers, and their typesetting."""
