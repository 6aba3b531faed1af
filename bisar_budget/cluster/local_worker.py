"""What Dask runs first in each worker process that `local:N` starts."""

import signal


def dask_setup(worker: object) -> None:
    """Leave Ctrl-C, which a terminal sends to every process, to the command: it ends its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
