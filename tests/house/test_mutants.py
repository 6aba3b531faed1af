"""The list of mutants fits the code of today: `docs/prove_mutants.py` runs it."""

import re

import pytest

from tests.mutants import MUTANTS, ROOT, Mutant


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_a_mutant_changes_one_place_and_names_tests_that_exist(mutant: Mutant) -> None:
    text = (ROOT / mutant.path).read_text(encoding="utf-8")
    assert mutant.of(text) != text
    assert mutant.tests
    for test in mutant.tests:
        file, *names = test.split("::")
        code = (ROOT / file).read_text(encoding="utf-8")
        for name in names:
            assert re.search(rf"(?m)^\s*(def|class) {re.escape(name)}\b", code), test


def test_names_are_distinct() -> None:
    assert len({mutant.name for mutant in MUTANTS}) == len(MUTANTS)


def test_a_mutant_whose_place_is_gone_is_an_error() -> None:
    with pytest.raises(ValueError, match="has 0 times 'old'"):
        Mutant("one", "file.py", "old", "new", ("tests",)).of("changed since")
