"""Changes to the text of a `robot.yaml` that keep its comments and layout."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from seals.errors import ConfigError
from seals.untrusted_io import plain_yaml


def with_number(text: str, path: Sequence[str], change: Callable[[float], float]) -> str:
    r"""Return the text with one number, or each number of a list, changed.

    Args:
        text: of the file.
        path: keys that lead to the number.
        change: takes a number and returns the new one.

    Raises:
        ConfigError: the file holds something else there.

    Example:
        >>> text = "effects:\n  hull: {effect: lift, mass: 2.0}  # weighed\n"
        >>> print(with_number(text, ["effects", "hull", "mass"], lambda m: 2.5), end="")
        effects:
          hull: {effect: lift, mass: 2.5}  # weighed
    """
    root = _root(text)
    node = _found(root, path)
    numbers = node.value if _kind(node) == "sequence" else [node]
    seen = [one for one in _nodes(root) if any(one is other for other in (node, *numbers))]
    if len(seen) != len({id(one) for one in (node, *numbers)}):
        raise _by_hand(path, "is used at several places through an alias")
    # from the last one on: what stands before keeps its place
    for one in reversed(numbers):
        old = _scalar(one)
        if old is None:
            raise _by_hand(path, "is not a number or a list of numbers")
        new = figure(change(old))
        text = text[: one.start_mark.index] + new + text[one.end_mark.index :]
    return text


def with_entry(text: str, path: Sequence[str], value: str) -> str:
    """Return the text with a new key under an existing mapping, or at the end of the file.

    Args:
        text: of the file.
        path: keys that lead to the new one.
        value: what stands behind it.

    Raises:
        ConfigError: what stands above it is not a mapping.
    """
    root = _root(text)
    above = _found(root, path[:-1]) if path[:-1] and holds(text, path[:-1]) else None
    if above is None:
        key, *rest = path
        inner = value if not rest else "".join(f"{{{k}: " for k in rest) + value + "}" * len(rest)
        start = text if text.endswith("\n") or not text else f"{text}\n"
        return f"{start}{key}: {inner}\n"
    if _kind(above) != "mapping" or not (above.value or above.flow_style):
        raise _by_hand(path[:-1], "is not a mapping")
    if above.flow_style:
        at = above.end_mark.index - 1
        comma = ", " if above.value else ""
        return f"{text[:at].rstrip()}{comma}{path[-1]}: {value}{text[at:]}"
    first = above.value[0][0].start_mark
    return f"{text[: first.index]}{path[-1]}: {value}\n{' ' * first.column}{text[first.index :]}"


def without_entry(text: str, path: Sequence[str]) -> str:
    r"""Return the text without a key of a block, its value and the comment on its lines.

    Raises:
        ConfigError: the entry is part of a mapping in braces.

    Example:
        >>> print(without_entry("a:\n  b: 1  # one\n  c: 2\n", ["a", "b"]), end="")
        a:
          c: 2
    """
    refuse_braces(text, path[:-1])
    above = _found(_root(text), path[:-1])
    key, value = next((k, v) for k, v in above.value if k.value == path[-1])
    lines = text.splitlines(keepends=True)
    end, last = value.end_mark, value.end_mark.line
    if last < len(lines) and lines[last][: end.column].strip():
        last += 1
    else:
        # a block ends where the next key begins: what stands before that stays
        while last > key.start_mark.line + 1 and lines[last - 1].split("#")[0].strip() == "":
            last -= 1
    return "".join(lines[: key.start_mark.line] + lines[last:])


def refuse_braces(text: str, path: Sequence[str]) -> None:
    """Refuse a mapping in braces, where a line of its own cannot be changed.

    Raises:
        ConfigError: it is one.
    """
    if _found(_root(text), path).flow_style:
        raise ConfigError(
            f"robot.yaml: {'.'.join(path)} is written in braces.\nWrite one line per entry."
        )


def holds(text: str, path: Sequence[str]) -> bool:
    """Return true if the file has a value at a path."""
    node = _root(text)
    for key in path:
        if _kind(node) != "mapping":
            return False
        node = next((v for k, v in node.value if k.value == key), None)
        if node is None:
            return False
    return True


def figure(value: float) -> str:
    """Format a number for YAML and URDF with six significant digits.

    Example:
        >>> figure(2.6 / 3.0), figure(1.25e-7)
        ('0.866667', '1.25e-07')
    """
    return f"{value:.6g}"


def _root(text: str) -> Any:
    import yaml

    return yaml.compose(text, Loader=yaml.SafeLoader)


def _kind(node: Any) -> str:
    return "" if node is None else str(node.id)


def _scalar(node: Any) -> float | None:
    """Return a number as the robot's file means it; None for all else."""
    if _kind(node) != "scalar":
        return None
    try:
        # YAML takes 1e-5 for text, and so does no reader of the robot
        return float(node.value)
    except ValueError:
        known = node.tag.endswith((":int", ":float"))
        return float(plain_yaml(node.value)) if known else None


def _nodes(node: Any) -> Iterator[Any]:
    """Yield all nodes below one, as often as they are referred to."""
    yield node
    if _kind(node) in ("mapping", "sequence"):
        for entry in node.value:
            for part in entry if isinstance(entry, tuple) else (entry,):
                yield from _nodes(part)


def _by_hand(path: Sequence[str], why: str) -> ConfigError:
    return ConfigError(
        f"robot.yaml: {'.'.join(path)} {why}.\nWrite the value by hand: it is in calibration.json."
    )


def _found(node: Any, path: Sequence[str]) -> Any:
    for key in path:
        node = next(v for k, v in node.value if k.value == key)
    return node
