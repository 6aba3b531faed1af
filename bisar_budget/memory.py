"""Memory limits of the process (`ulimit -v`, `ulimit -d`), checked before libraries allocate memory.

A C library may end the process if it cannot allocate memory. OpenBLAS does so when NumPy is imported or
multiplies matrices for the first time; the process then ends with exit code 1 or with the signal of an interrupt.
LLVM does not return at all. Python code cannot catch these failures. If the required memory is known, it is therefore
compared with the limit before a library is used.
"""

import errno
import os
from collections.abc import Iterator

# Address space in bytes. With less, libraries may end the process, or report that they are not installed.
MIN_MEMORY_BYTES = 192 << 20  # NumPy with one thread of OpenBLAS takes 134 MB, a check a little more
TABLES_MEMORY_BYTES = 400 << 20
CLUSTER_MEMORY_BYTES = 3 << 29
_COMPILER_MEMORY_BYTES = 2 << 30  # LLVM hangs in 400 MB, and Numba takes more memory with each core
_REQUEST_BYTES = 32 << 20  # size of a single request of a library
_MEMORY_ERRORS = ("failed to map segment", "annot allocate memory", "bad_alloc", "out of memory")


def limit() -> int | None:
    """Memory that this process may allocate: the smaller of `ulimit -v` and `ulimit -d`; None if unlimited. [B]"""
    try:
        import resource
    except ImportError:  # Windows
        return None
    soft = [resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA)]
    return min((resource_limit for resource_limit in soft if resource_limit != resource.RLIM_INFINITY), default=None)


def limit_words() -> str:
    """Phrase for a message that states the memory limit; empty if there is no limit."""
    allowed = limit()
    return "" if allowed is None else f"the system allows {allowed >> 20} MB (ulimit -v, ulimit -d)"


def spare_threads() -> None:
    """Limit OpenBLAS to one thread; this has no effect if OpenBLAS is already loaded.

    If the environment sets a number of threads, this number is kept, unless the memory of the process is limited.
    With a second thread a check takes up to an eighth longer and is never faster, because the matrices to multiply
    are small. Each thread takes tens of MB, which count towards the limit.
    """
    if limit() is not None:
        os.environ.update(OPENBLAS_NUM_THREADS="1", ARROW_DEFAULT_MEMORY_POOL="system")
    elif not {"OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"} & os.environ.keys():
        os.environ["OPENBLAS_NUM_THREADS"] = "1"


def hold_room(needed: int, purpose: str) -> None:
    """Raise a `MemoryError` that names `purpose` if the memory limit is below `needed` [B]."""
    allowed = limit()
    if allowed is not None and allowed < needed:
        raise MemoryError(f"{purpose} needs at least {needed >> 20} MB of memory; {limit_words()}")


def is_spacious() -> bool:
    """Whether the memory limit is high enough for LLVM, the compiler behind Numba."""
    allowed = limit()
    return allowed is None or allowed >= _COMPILER_MEMORY_BYTES


def ran_out(error: BaseException) -> bool:
    """Whether an error, or an error that caused it, shows that memory ran out.

    If the memory use of the process came close to its limit, any error is attributed to a lack of memory.
    """
    return any(map(_says_memory, _causes(error))) or _is_near_limit()


def _says_memory(error: BaseException) -> bool:
    if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM):
        return True
    words = (*_MEMORY_ERRORS, "can't start new thread") if limit() is not None else _MEMORY_ERRORS
    return any(cause in str(error) for cause in words)


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        yield error
        error = error.__cause__ or error.__context__


def _is_near_limit() -> bool:
    """Whether the peak memory use of the process came close to the limit."""
    allowed = limit()
    if allowed is None:
        return False
    try:
        with open("/proc/self/status", encoding="ascii") as file:
            peak = next(int(line.split()[1]) << 10 for line in file if line.startswith("VmPeak"))
    except (OSError, StopIteration):  # not Linux
        return False
    return peak > allowed - _REQUEST_BYTES
