"""A law that is broken is noticed, and one that nothing guards is found."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import mutations

ROOT = Path(__file__).parents[2]


@pytest.mark.thorough
def test_broken_laws_are_noticed() -> None:
    """Wrong sign, frame, attitude and size of a bias each fail a unit test."""
    found = list(mutations.examined(mutations.mutants_of("effect", "gyroscope_bias")))
    assert [o.line() for o in found if not o.kept] == []
    assert sum(o.changes for o in found) == 3
    assert all(o.test for o in found if o.changes)


def test_a_law_without_guard_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """With no test that asks for the law, every mutant of a bias survives its contract, too."""
    monkeypatch.setattr(mutations, "guards", lambda mutant: [])
    found = list(mutations.examined(mutations.mutants_of("effect", "gyroscope_bias")))
    assert [o.kept for o in found] == [True, False, False, True, False]
    assert "SURVIVED" in found[1].line()


def test_a_mutant_is_put_back() -> None:
    """Afterwards the class has its own law again, inherited or not."""
    from seals import registry

    cls = registry.get("effect", "tether").load()
    before = vars(cls)["loads"]
    with mutations.broken(mutations.mutants_of("effect", "tether")[1]):
        assert vars(cls)["loads"] is not before
    assert vars(cls)["loads"] is before


@pytest.mark.slow
def test_every_broken_law_is_noticed(capsys: pytest.CaptureFixture[str]) -> None:
    """No mutant of any installed effect or actuator survives."""
    assert mutations.main([]) == 0, capsys.readouterr().out
