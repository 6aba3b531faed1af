"""The mission file: what it may say (`model`), how it is read (`load`), its JSON Schema (`schema`)."""
