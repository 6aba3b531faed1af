"""A note: a sentence with its code and the values that it is made of."""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec

P = ParamSpec("P")


class Note(str):
    """A sentence as data: `code` names it, `values` are its numbers in SI, ids and names."""

    __slots__ = ("code", "values")
    code: str
    values: tuple[object, ...]

    def __new__(cls, text: str, code: str = "", values: tuple[object, ...] = ()) -> "Note":
        """Attach code and values to a text."""
        note = super().__new__(cls, text)
        note.code, note.values = code, values
        return note

    def then(self, *more: str) -> "Note":
        """Append texts after semicolons. Empty texts are left out; an empty note stays empty."""
        if not self:
            return self
        return Note("; ".join(filter(None, (self, *more))), self.code, (*self.values, *filter(None, more)))

    def includes(self, other: "Note") -> bool:
        """Whether this note, or one that it appends, has the code and the values of another note."""
        is_same = self.code == other.code and self.values[: len(other.values)] == other.values
        return is_same or any(isinstance(value, Note) and value.includes(other) for value in self.values)


NOTHING = Note("")
COMPOSED: dict[str, str] = {}  # docstring of each function that composes a sentence, by code


def composed(sentence: Callable[P, str]) -> Callable[P, Note]:
    """Decorate a function that composes a sentence: it returns a note, whose code is the function's name."""
    code = sentence.__name__.replace("_", "-")
    COMPOSED[code] = sentence.__doc__ or ""

    @wraps(sentence)
    def written(*args: P.args, **kwargs: P.kwargs) -> Note:
        return Note(sentence(*args, **kwargs), code, (*args, *kwargs.values()))

    return written
