"""``seals diagnose``: reads a log, names what its model is missing, writes the answer."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from seals.diagnose.diagnosis import Diagnosis, diagnose
from seals.diagnose.parallel import cores
from seals.diagnose.verdict import Verdict
from seals.diagnose.words import sentence
from seals.errors import ConfigError, LogError
from seals.logs import refuse_if_bad
from seals.logs.atomic import write_text

ANSWER = "diagnosis.json"


def execute(config: Any) -> int:
    """Run one composed diagnosis and return its exit code.

    Raises:
        ConfigError: no log is given, or it is not there.
    """
    from hydra.core.hydra_config import HydraConfig

    from seals.config.build import build

    if config.log is None:
        raise ConfigError("log is not given.\nSay which: seals diagnose log=FOLDER out=FOLDER")
    if not Path(str(config.log)).exists():
        raise ConfigError(f"log={config.log}: there is no such file or folder.\nGive a log folder.")
    out = Path(config.out or HydraConfig.get().runtime.output_dir)
    reader = build(config.reader, where="reader")
    try:
        logs = reader.read(str(config.log))
        for log in logs:
            refuse_if_bad(log)
        found = diagnose(logs[0], processes=config.processes or cores())
    except LogError as refusal:
        _write(out, _bad(str(refusal)))
        print(f"bad data: {refusal}")
        return Verdict.bad_data.exit_code
    _write(out, found.to_dict())
    print(sentence(found))
    print(f"\n{out / ANSWER}")
    return found.answer.verdict.exit_code


def _bad(words: str) -> dict[str, Any]:
    return {
        "verdict": Verdict.bad_data.value,
        "effects": [],
        "ambiguous_with": [],
        "next_experiment": None,
        "held_out_error": None,
        "reasons": [words],
    }


def _write(out: Path, answer: dict[str, Any]) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"out={out} is not a folder: {error}.\nGive another folder.") from error
    write_text(out / ANSWER, json.dumps(answer, indent=1) + "\n")


__all__ = ["Diagnosis", "execute"]
