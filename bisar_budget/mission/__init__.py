"""The mission file: what it may say (`model`), how it is read (`load`), its JSON Schema (`schema`)."""

__all__ = ["load", "model", "readers", "revision", "schema", "symmetric"]  # what other rooms may use
