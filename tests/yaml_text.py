"""YAML of what a test builds, by LibYAML where that writes the same bytes: most missions of tests are written so."""

import json
from typing import Any

import yaml


class PlainDumper(yaml.SafeDumper):
    """Writes no aliases; a lone surrogate is written as it is."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


class _FastDumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """Writes what `PlainDumper` does, four times as fast, where all text is ASCII and no key is empty."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def yaml_text(tree: Any, **style: Any) -> str:
    """YAML of a tree, its keys in their order; `style` as `yaml.dump` takes it."""
    text = json.dumps(tree, ensure_ascii=False, default=str)
    dumper = _FastDumper if text.isascii() and '"":' not in text else PlainDumper
    return yaml.dump(tree, Dumper=dumper, sort_keys=False, **style)
