"""Define the note: a sentence together with its code and the values in it."""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec

P = ParamSpec("P")


class Note(str):
    """A sentence with its data: `code` identifies it, and `values` are its numbers in SI units, ids and names."""

    __slots__ = ("code", "values")
    code: str
    values: tuple[object, ...]

    def __new__(cls, text: str, code: str = "", values: tuple[object, ...] = ()) -> "Note":
        """Create a note from its text, the code that identifies the sentence, and the values in the text."""
        note = super().__new__(cls, text)
        note.code, note.values = code, values
        return note

    def then(self, *more: str) -> "Note":
        """Append strings to the note, separated by semicolons.

        Empty strings are left out, and an empty note stays empty.
        """
        if not self:
            return self
        return Note("; ".join(filter(None, (self, *more))), self.code, (*self.values, *filter(None, more)))

    def includes(self, other: "Note") -> bool:
        """Whether this note, or a note appended to it, has the code and the values of another note."""
        is_same = self.code == other.code and self.values[: len(other.values)] == other.values
        return is_same or any(isinstance(value, Note) and value.includes(other) for value in self.values)


NOTHING = Note("")
COMPOSED: dict[str, str] = {}  # docstring of each function that composes a sentence, by code


def composed(sentence: Callable[P, str]) -> Callable[P, Note]:
    """Decorate a function that composes a sentence, so that it returns a note whose code is the function's name."""
    code = sentence.__name__.replace("_", "-")
    COMPOSED[code] = sentence.__doc__ or ""

    @wraps(sentence)
    def written(*args: P.args, **kwargs: P.kwargs) -> Note:
        return Note(sentence(*args, **kwargs), code, (*args, *kwargs.values()))

    return written
