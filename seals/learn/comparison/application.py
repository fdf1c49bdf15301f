"""``seals evaluate --compare``: compares the arms of a study from the tables of their runs."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from seals.errors import ConfigError
from seals.learn.comparison.outcome import Study
from seals.learn.comparison.page import write_study
from seals.learn.comparison.runs import find_arms, read_run
from seals.learn.comparison.settings import AnalysisPlan, ArmsSettings
from seals.learn.comparison.study import compare
from seals.learn.comparison.words import arm_rows, claims, comparison_rows, terms_words, text_table
from seals.schema import check_value, parameters_of


def execute(config: Any) -> int:
    """Compare the arms of a composed configuration and print the claims that the intervals allow.

    Args:
        config: with the keys of ``seals.learn.comparison.settings.ArmsSettings``.

    Raises:
        SealsError: there is nothing to compare, a run cannot be read, or one ends too early.
    """
    from hydra.core.hydra_config import HydraConfig

    out = Path(str(config.out or HydraConfig.get().runtime.output_dir))
    if out.exists() and not out.is_dir():
        raise ConfigError(f"out={out} is a file.\nGive a folder.")
    study = _study_of(config)
    made = write_study(study, out, title=str(config.title))
    print(terms_words(study))
    print()
    print(text_table(*arm_rows(study)))
    if study.duels:
        print()
        print(text_table(*comparison_rows(study)))
        print()
    for line in (*claims(study), *study.remarks):
        print(line)
    for path in made:
        print(path)
    return 0


def _study_of(config: Any) -> Study:
    """Read the runs that a configuration names, and compare them.

    Raises:
        SealsError: as for :func:`execute`.
    """
    folders = find_arms(dict(config.arms), config.study)
    arms = {n: [read_run(folder, arm=n) for folder in where] for n, where in folders.items()}
    declared = parameters_of(ArmsSettings)
    for name, parameter in declared.items():
        check_value(name, config[name], parameter)
    terms = {one.name: config[one.name] for one in dataclasses.fields(AnalysisPlan)}
    return compare(arms, AnalysisPlan(**terms))
