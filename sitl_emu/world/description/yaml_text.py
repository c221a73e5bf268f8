"""YAML as users write it, for scenarios and worlds: what YAML lets pass though nobody means it is an error here."""

from typing import Any

import yaml

LOADER: type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""libyaml's, where PyYAML has it: a tenth of the time for a large world."""

DEEPEST = 100
"""Mappings and lists within each other; ours. libyaml's loader ends the process where they are tens of thousands."""
BEGINNINGS, ENDS = (yaml.MappingStartEvent, yaml.SequenceStartEvent), (yaml.MappingEndEvent, yaml.SequenceEndEvent)


class YamlError(ValueError):
    """No YAML, or a key that is given twice; the text is one line for people."""


class _Loader(LOADER):  # type: ignore[misc]
    """One that takes no key twice: of two values the last would count, and nobody would know."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._looked_at = set[int]()

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        """What is called for every mapping before `<<` puts keys of others into it, which may be there as well."""
        if id(node) not in self._looked_at:
            self._looked_at.add(id(node))
            lines = dict[str, int]()
            for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
                line = key.start_mark.line + 1
                if key.value in lines:
                    first = lines[key.value]
                    raise YamlError(f"line {line}: {key.value!r} stands in line {first} already; give it once")
                lines[key.value] = line
        super().flatten_mapping(node)


def load(text: str) -> Any:
    """What a YAML text says. Raises YamlError."""
    try:
        _check_depth(text)
        loader = _Loader(text)
        try:
            return loader.get_single_data()
        finally:
            loader.dispose()
    except YamlError:
        raise
    except (yaml.YAMLError, ValueError) as error:
        raise YamlError(f"not YAML: {' '.join(str(error).split())}") from None


def _check_depth(text: str) -> None:
    depth = 0
    for event in yaml.parse(text, LOADER):
        if isinstance(event, BEGINNINGS):
            depth += 1
            if depth > DEEPEST:
                line = event.start_mark.line + 1
                raise YamlError(f"line {line}: nested too deeply; at most {DEEPEST} mappings and lists in each other")
        elif isinstance(event, ENDS):
            depth -= 1
