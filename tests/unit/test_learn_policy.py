"""A policy's folder: it comes back as it was, and nothing strange comes with it."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from seals.errors import ConfigError, MissingExtra, SealsError
from seals.learn.metadata import config_hash
from seals.learn.policy import load_policy, read_policy_metadata, save_policy
from seals.learn.starts import TRAINING_END, held_out_seeds, training_seed, validation_seeds

torch = pytest.importorskip("torch", reason="the extra learn is not installed")
pytest.importorskip("torchrl", reason="the extra learn is not installed")
pytest.importorskip("safetensors", reason="the extra learn is not installed")


@pytest.fixture
def saved(tmp_path: Path) -> tuple[Path, Any]:
    """A policy's folder and the network that was saved."""
    from seals.learn.networks import actor_of, description

    torch.manual_seed(3)
    network = description(observation=5, action=2, hidden=[8, 8], layer_norm=True)
    actor = actor_of(network)
    # an untrained normaliser would hide that its buffers are kept
    actor[0].running_mean += torch.arange(5.0)
    metadata = {"env": "Toy-v0", "config_hash": config_hash({}), "learner": "sac", "seed": 1}
    folder = save_policy(
        tmp_path / "policy", network=network, tensors=actor.state_dict(), metadata=metadata
    )
    return folder, actor


def test_a_policy_comes_back(saved: tuple[Path, Any]) -> None:
    """The actions of the loaded policy are those of the saved one, bit for bit."""
    folder, actor = saved
    policy = load_policy(folder)
    seen = torch.randn(7, 5)
    policy.begin([0] * 7)
    assert torch.equal(policy.act(seen), actor(seen).detach())
    assert not policy.act(seen).requires_grad
    assert policy.metadata["learner"] == "sac"


def edit(**change: Any) -> Callable[[Path], None]:
    """Return a fault: entries of the metadata replaced."""

    def fault(folder: Path) -> None:
        metadata = json.loads((folder / "card.json").read_text())
        (folder / "card.json").write_text(json.dumps({**metadata, **change}))

    return fault


def network(**change: Any) -> Callable[[Path], None]:
    """Return a fault: entries of the description of the network replaced."""

    def fault(folder: Path) -> None:
        metadata = json.loads((folder / "card.json").read_text())
        edit(network={**metadata["network"], **change})(folder)

    return fault


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (lambda f: (f / "card.json").unlink(), "there is no card.json"),
        (edit(format="seals-demonstrations"), "Allowed here: 'seals-policy'"),
        (edit(network=[]), r"network=\[\] .*\n.*a mapping"),
        (edit(network={"kind": "mlq"}), "Did you mean 'mlp'"),
        (network(hidden=[65_536, 65_536]), "do not match"),
        (network(observation=float("inf")), "description of a policy cannot be used"),
        (network(action=-1), "description of a policy cannot be used"),
        (network(hidden="a"), r"hidden=\['a'\] is not allowed"),
        (lambda f: (f / "policy.safetensors").unlink(), "is missing"),
        (lambda f: (f / "policy.safetensors").write_bytes(b"\x80\x04N."), "format safetensors"),
        (
            lambda f: (f / "policy.safetensors").write_bytes((2**60).to_bytes(8, "little") + b"{}"),
            "format safetensors",
        ),
    ],
)
def test_strange_policies_are_refused(
    saved: tuple[Path, Any], fault: Callable[[Path], object], words: str
) -> None:
    """A missing, foreign, hostile or broken part is refused in two lines."""
    folder, _ = saved
    fault(folder)
    with pytest.raises(ConfigError, match=words) as refusal:
        load_policy(folder)
    assert len(str(refusal.value).splitlines()) == 2


def test_an_absent_folder_is_refused(tmp_path: Path) -> None:
    """The words name the key of the command line."""
    with pytest.raises(ConfigError, match=r"policy=.*nowhere: there is no card.json"):
        read_policy_metadata(tmp_path / "nowhere")


def test_the_folder_of_a_training_leads_to_its_policy(saved: tuple[Path, Any]) -> None:
    """Who names the folder above is told which one holds the policy."""
    folder, _ = saved
    with pytest.raises(ConfigError, match=rf"Did you mean policy={folder}\?"):
        read_policy_metadata(folder.parent)


def test_starts_never_meet() -> None:
    """Training, choosing and judging have seeds of their own."""
    chosen, judged = set(validation_seeds(1000)), set(held_out_seeds(1000))
    assert not chosen & judged
    assert min(chosen | judged) >= TRAINING_END
    assert training_seed(0) == 0
    for seed in (TRAINING_END, held_out_seeds(1)[0], -1):
        with pytest.raises(SealsError, match="reserved for the evaluation"):
            training_seed(seed)
    with pytest.raises(SealsError, match="0 starts"):
        held_out_seeds(0)


@pytest.mark.parametrize("package", ["torch", "safetensors"])
def test_a_missing_package_names_its_extra(
    saved: tuple[Path, Any], package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without the packages for learning the words say what to install."""
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingExtra, match=rf"(?s){package}.*aam-seals\[learn\]"):
        load_policy(saved[0])
