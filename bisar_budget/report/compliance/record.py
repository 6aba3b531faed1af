"""Chapter on the document of a mission: its change record, the git repository, and all files read for the mission."""

from collections.abc import Iterator

from bisar_budget.mission.inputs import InputFile, input_files
from bisar_budget.mission.model import Document
from bisar_budget.mission.work_tree import WorkTree
from bisar_budget.report import document as doc
from bisar_budget.report.compliance.rows import Page
from bisar_budget.report.words.heading import document_words
from bisar_budget.report.words.sentences import counted

_LISTED_FILE_COUNT = 3  # inputs that a fact names


def document_facts(document: Document, work_tree: WorkTree | None) -> Iterator[tuple[doc.Text, doc.Text]]:
    """Yield the facts that identify a document: number, issue, author, applicable documents, and commit."""
    if words := document_words(document):
        yield "Document", words + (f"; author {document.author}" if document.author else "")
    elif document.author:
        yield "Author", document.author
    if document.applicable:
        yield "Applicable", "; ".join(document.applicable)
    if work_tree is not None:
        yield "Repository", commit_words(work_tree)


def commit_words(work_tree: WorkTree) -> doc.Text:
    """Text with the current commit of a git repository, and whether files have changed since this commit."""
    if not work_tree.commit:
        return work_tree.reason
    clauses = []
    if work_tree.changed:
        clauses.append(f"not clean, {counted(len(work_tree.changed), 'file')} changed since")
    if work_tree.changed_inputs:
        clauses.append(f"changed inputs: {_named(work_tree.changed_inputs)}")
    if work_tree.new_inputs:
        clauses.append(f"inputs never committed: {_named(work_tree.new_inputs)}")
    state = "; ".join(clauses) or "clean"
    return "commit ", doc.Styled("digest", work_tree.commit), f", {state}"


def _named(files: tuple[str, ...]) -> str:
    """Text with the names of the first files, and the number of further files."""
    unlisted_count = len(files) - _LISTED_FILE_COUNT
    return ", ".join(files[:_LISTED_FILE_COUNT]) + (f" and {unlisted_count} more" if unlisted_count > 0 else "")


def record(page: Page) -> doc.Chapter:
    """Return the chapter with the change record of the document, and a table of all inputs with their SHA-256."""
    blocks: list[doc.Block] = []
    if changes := page.mission.document.changes:
        lines: list[doc.Line] = [(change.issue, change.date.isoformat(), change.what) for change in changes]
        columns = doc.heads("Issue", "Date", "Change")
        blocks.append(doc.TextTable("", "Change record", columns, lines, "changes"))
    columns = doc.heads("Input", "File", "SHA-256")
    lines = [_input_line(page, file) for file in input_files(page.mission)]
    blocks.append(doc.TextTable(f"Inputs of {page.name}", "Files that were read", columns, lines, "files"))
    return doc.Chapter("Document and inputs", blocks, f"{page.anchor}-record")


def has_record(page: Page) -> bool:
    """Whether the document record of a mission has any content besides the mission file.

    The mission file alone needs no record, because its SHA-256 is stated at the head of the chapter on the mission.
    """
    return bool(page.mission.document.changes) or len(input_files(page.mission)) > 1


def _input_line(page: Page, file: InputFile) -> doc.Line:
    shown_name = page.file if file.use == "mission" else file.name.replace("\\", "/")
    return file.use, doc.Styled("id", doc.Name(shown_name)), doc.Styled("digest", file.digest or "not read")
