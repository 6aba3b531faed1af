"""Explanations of the status of a row: the equations with their numbers, and their typesetting."""
