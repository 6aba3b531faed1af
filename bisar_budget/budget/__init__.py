"""From a mission to findings: what each error does, what it may be, whether it is."""
