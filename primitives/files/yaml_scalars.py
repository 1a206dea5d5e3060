"""Which value a YAML scalar stands for, and plain data as YAML.

YAML 1.2's core schema in decimal, not PyYAML's: ``1e-3`` is a number, ``1:30``, ``0x10`` and ``yes`` are text. What
`to_yaml` writes is read back as equal data, floats to the bit.
"""

import re
from math import isfinite
from typing import Any

import yaml

from primitives.errors import InputError

_NUMBER = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_WHOLE = re.compile(r"[-+]?[0-9]{1,15}")
_SPECIAL = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_BOOLEAN = re.compile("true|True|TRUE|false|False|FALSE")
_NULL = re.compile("~|null|Null|NULL|")


def resolve(text: str) -> Any:
    """The value of a scalar without quotes: None, a boolean, a number or the text itself.

    Raises
    ------
    InputError : NaN, an infinity, or a number too large for a float.
    """
    if _NULL.fullmatch(text):
        return None
    if _BOOLEAN.fullmatch(text):
        return text.lower() == "true"
    if _WHOLE.fullmatch(text):
        return int(text)
    special = _SPECIAL.fullmatch(text)
    if special or _NUMBER.fullmatch(text):
        value = float(text.replace(".", "", 1) if special else text)
        if not isfinite(value):
            raise InputError(f"expected a finite number, got {text[:40]}")
        return value
    return text


class _Dumper(yaml.SafeDumper):
    yaml_implicit_resolvers: dict[Any, Any] = {}  # noqa: RUF012

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _float(dumper: yaml.SafeDumper, value: float) -> yaml.Node:
    if not isfinite(value):
        raise InputError(f"expected finite numbers to write to a file, got {value}")
    return dumper.represent_scalar("tag:yaml.org,2002:float", repr(float(value)))


_Dumper.add_representer(float, _float)
for _tag, _pattern, _first in (
    ("null", _NULL, ["~", "n", "N", ""]),
    ("bool", _BOOLEAN, list("tTfF")),
    ("int", _WHOLE, list("-+0123456789")),
    ("float", _NUMBER, list("-+.0123456789")),
    ("float", _SPECIAL, list("-+.")),
):
    _Dumper.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(f"(?:{_pattern.pattern})$"), _first)


def to_yaml(data: Any) -> str:
    """Plain data as YAML: lists of numbers in one line, floats with all their digits, no anchors.

    Raises
    ------
    InputError : a number that is not finite, or a value that is no plain data.
    """
    try:
        return str(
            yaml.dump(data, Dumper=_Dumper, default_flow_style=None, sort_keys=False, allow_unicode=True, width=110)
        )
    except (yaml.YAMLError, UnicodeEncodeError) as error:
        raise InputError(f"cannot be written as YAML: {error}") from None
