"""Fuzz targets: hostile tensors, demonstrations of the former format, folders of configuration."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from benchmarks.fuzz_described import bent
from benchmarks.fuzz_stored import STORED
from benchmarks.fuzz_targets import Target

_OFFSETS = (-1, 0, 1, 7, 8, 64, 2**31, 2**53, 2**63, 2**64 - 1, 2**64)
_SHAPES = (-1, 0, 1, 2, 3, 2**31, 2**32, 2**63 - 1, 10**30)
_KINDS = ("F32", "F64", "F16", "BF16", "F8_E4M3", "I64", "U8", "BOOL", "C64", "X9", "", None)


def _tensors(whole: bytes) -> Callable[[Random], bytes]:
    """Return a grammar of files of safetensors whose headers declare what is not there."""
    length = int.from_bytes(whole[:8], "little")
    header, body = json.loads(whole[8 : 8 + length]), whole[8 + length :]

    def draw(data: Random) -> bytes:
        tree = json.loads(json.dumps(header))
        names = [name for name in tree if name != "__metadata__"]
        for _ in range(data.randint(1, 3)):
            name, other = data.choice(names), data.choice(names)
            entry = tree.get(name)
            kind = data.randint(0, 6)
            if not isinstance(entry, dict):
                continue
            if kind == 0:  # the bytes of another, or of all
                last = tree[other]["data_offsets"] if isinstance(tree.get(other), dict) else [0, 0]
                entry["data_offsets"] = data.choice((last, [0, len(body)], last[::-1]))
            elif kind == 1:
                entry["data_offsets"][data.randint(0, 1)] = data.choice(_OFFSETS)
            elif kind == 2:
                entry["shape"] = [data.choice(_SHAPES) for _ in range(data.choice((0, 1, 2, 90)))]
            elif kind == 3:
                entry["dtype"] = data.choice(_KINDS)
            elif kind == 4:
                tree[data.choice(("", "../a", "x" * 9999, "__metadata__", "\0"))] = entry
            elif kind == 5:
                tree.pop(name)
            else:
                tree = bent(data, tree)
                break
        text = json.dumps(tree).encode("utf-8", "replace")
        if data.random() < 0.1:  # a key twice, many levels, blanks without end
            text = data.choice((text[:-1] + b"," + text[1:], b"[" * 90_000, b" " * 200_000 + text))
        size = data.choice((len(text),) * 9 + tuple(n & (2**64 - 1) for n in _OFFSETS))
        tail = data.choice((body, body, body, b"", body + body, body[:-1]))
        return size.to_bytes(8, "little") + text + tail

    return draw


def _of_tensors(name: str) -> Callable[[], Target]:
    """Return the target of a stored file of tensors."""

    def build() -> Target:
        target = STORED[name]()
        target.draw = _tensors(target.whole)
        return target

    return build


def _mapped() -> Target:
    """Demonstrations of the former format, with metadata that declares something else."""
    from seals.learn.demonstrations.folder import SUFFIX, read

    target = STORED["demo_card"]()
    tree = json.loads(target.whole)
    rows, beside = 12, dict[str, bytes]()
    flags = np.tile(np.arange(6) == 5, 2).astype(np.uint8).tobytes()
    for name, width in (("observation", 4), ("reward", 1)):
        raw = np.ones(rows * width, np.float32).tobytes()
        beside |= {f"{name}{SUFFIX}": raw, f"next/{name}{SUFFIX}": raw}
    beside[f"action{SUFFIX}"] = np.zeros(rows * 2, np.float32).tobytes()
    beside[f"next/terminated{SUFFIX}"] = flags
    beside[f"next/truncated{SUFFIX}"] = bytes(rows)
    return Target(
        whole=target.whole,
        name=target.name,
        load=read,
        beside=beside,
        folder=True,
        draw=lambda data: json.dumps(bent(data, tree)).encode("utf-8", "replace"),
    )


_GLOBAL = "# @package _global_\n"
_WORDS = (
    *(
        "a",
        "b",
        "c",
        "/robot: ball",
        "/robot: null",
        "_self_",
        "a@x",
        "b@y",
        "override /water: none",
    ),
    *("optional gone", "/experiment: a", "/experiment: [b, c]", "/experiment@z: '${experiment}'"),
)
_TEXTS = (
    *("${name}", "${seed}", "${time}", "${time.step}${time.duration}", "${..name}", "${.name}"),
    *("${oc.env:HOME}", "a", "1e999", "\x1b[2J", "${a${b}}", "${", "x" * 300, "${hydra:x}"),
)
_KEYS = ("name", "seed", "time", "robot", "water", "effects", "initial", "hydra", "_target_", "x")


def _folder() -> Target:
    """A folder of configuration, up to the settings of a run."""
    import shutil

    import yaml

    from seals.config.checks import refuse_growth
    from seals.config.refusal import refusals
    from seals.config.strangers import refuse_commands

    def load(folder: Path) -> None:
        from hydra import compose as hydra_compose
        from hydra import initialize_config_module
        from hydra.core.global_hydra import GlobalHydra

        from seals.config.source import install
        from seals.run.build import build_run

        shutil.rmtree(folder / "experiment", ignore_errors=True)
        (folder / "experiment").mkdir()
        for k, part in enumerate((folder / "all.yaml").read_text().split("\0")):
            (folder / "experiment" / f"{'abc'[k % 3]}.yaml").write_text(part)
        (folder / "all.yaml").unlink()
        refuse_commands(folder)
        install()
        GlobalHydra.instance().clear()
        words = ["robot=ball", "experiment=a", f"hydra.searchpath=[file://{folder}]"]
        with refusals(words), initialize_config_module("seals.conf", version_base="1.3"):
            config = hydra_compose("run", overrides=words)
        refuse_growth(config)
        with refusals(words):
            build_run(config)

    def value(data: Random, depth: int) -> Any:
        if depth == 0 or data.random() < 0.6:
            return data.choice((*_TEXTS, 0, -1, 1e308, None, True))
        if data.random() < 0.3:
            return [value(data, depth - 1) for _ in range(data.randint(0, 3))]
        return {data.choice(_KEYS): value(data, depth - 1) for _ in range(data.randint(0, 3))}

    def draw(data: Random) -> bytes:
        parts = []
        for _ in range(3):
            chosen = [data.choice(_WORDS) for _ in range(data.randint(0, 4))]
            head = data.choice(
                ("# @package _global_\n", "# @package _global_\n", "", "# @package a\n")
            )
            body = {data.choice(_KEYS): value(data, 3) for _ in range(data.randint(0, 3))}
            defaults = (
                f"defaults: [{', '.join('{' + w + '}' if ': ' in w else w for w in chosen)}]\n"
            )
            parts.append(head + defaults * bool(chosen) + yaml.safe_dump(body))
        return "\0".join(parts).encode()

    whole = b"# @package _global_\ndefaults: [b]\n\0# @package _global_\nname: a\n\0{}\n"
    return Target(whole=whole, name="all.yaml", load=load, folder=True, draw=draw)


TENSORS: dict[str, Callable[[], Target]] = {
    "hostile_weights": _of_tensors("weights"),
    "hostile_demo": _of_tensors("demo_steps"),
    "demo_mapped": _mapped,
    "config_folder": _folder,
}
"""Targets by name."""
