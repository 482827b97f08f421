"""YAML as plain data only: no tags, no aliases, no repeated keys, and never large or deep.

An alias of an alias of an alias makes gigabytes of a few lines, and a deep nesting ends a recursive reader; both
are counted on the stream of events, before anything is built.
"""

from collections.abc import Callable, Collection
from typing import Any

import yaml

from touchline.core.errors import BadInput

MAX_BYTES = 256 * 1024
MAX_DEPTH = 20
_FIX = "Send plain YAML: mappings, lists, text and numbers."


class _OnceEach(yaml.constructor.BaseConstructor):
    """For a loader: a key that comes twice is an error and not a silent overwrite."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        keys: set[str] = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode) or key.value in keys:
                raise yaml.constructor.ConstructorError(
                    None, None, "a key is used twice, or is not text", key.start_mark
                )
            keys.add(key.value)
        return super().construct_mapping(node, deep)


class _Typed(_OnceEach, yaml.CSafeLoader):
    """Numbers, dates and truths as YAML 1.1 reads them."""


class _Text(_OnceEach, yaml.CBaseLoader):
    """Every value as it is written: YAML 1.1 takes 1:30 for 90, 010 for 8 and 1e-5 for a word."""


def plain_from_yaml(raw: bytes, what: str) -> Any:
    """The data in a YAML text. what: how an error calls it, such as "The file table.yaml"."""
    return _loaded(raw, what, (), lambda text: yaml.load(text, _Typed))


def texts_from_yaml(raw: bytes, what: str, tags: Collection[str] = ()) -> list[Any]:
    """The data of every document of a YAML text, every scalar as the text it is.

    tags: those that are let pass, and mean nothing.
    """
    return _loaded(raw, what, tags, lambda text: [*yaml.load_all(text, _Text)])


def _loaded(raw: bytes, what: str, tags: Collection[str], load: Callable[[str], Any]) -> Any:
    if len(raw) > MAX_BYTES:
        raise _refuse(
            f"{what} has {len(raw)} bytes; the limit is {MAX_BYTES}.", "Send a shorter one."
        )
    try:
        text = raw.decode("utf-8-sig")
        _check_events(text, what, tags)
        return load(text)
    except BadInput:
        raise
    # ValueError: dates that do not exist, numbers of too many digits; RecursionError: belt and braces.
    except (yaml.YAMLError, UnicodeError, ValueError, TypeError, RecursionError) as error:
        where = getattr(error, "problem_mark", None)
        line = f" (line {where.line + 1})" if where else ""
        raise _refuse(
            f"{what} is not valid YAML{line}: {getattr(error, 'problem', None) or error}.", _FIX
        ) from None


def _check_events(text: str, what: str, tags: Collection[str]) -> None:
    depth = 0
    for event in yaml.parse(text, yaml.CSafeLoader):
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise _refuse(
                f"{what} uses an anchor or an alias.", "Write the value out where it is used."
            )
        tag = getattr(event, "tag", None)
        if tag and tag not in tags:
            raise _refuse(f"{what} uses a tag ({tag[:40]}).", _FIX)
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(
            event, yaml.CollectionEndEvent
        )
        if depth > MAX_DEPTH:
            raise _refuse(f"{what} has more than {MAX_DEPTH} levels.", "Use fewer levels.")


def _refuse(what: str, fix: str) -> BadInput:
    return BadInput(what, fix, reason="bad-yaml")
