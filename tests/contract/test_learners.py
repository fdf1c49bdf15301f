"""Every installed learner keeps the contract of its kind, and a learner that breaks it is found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from seals import registry
from seals.config.compose import compose
from seals.plugins.learners.sac import SAC, SacAgent
from seals.testing import ContractError, check_learner

torch = pytest.importorskip("torch")
pytest.importorskip("torchrl")
torch.set_num_threads(1)

OFF_POLICY = {"hidden": [16, 16], "batch": 16, "random_steps": 20, "capacity": 500}
VALUES: dict[str, dict[str, Any]] = {
    "sac": OFF_POLICY,
    "visual_sac": {**OFF_POLICY, "channels": 4, "batch": 8},
    "bc": {"hidden": [16], "batch": 16, "updates": 40, "look": 10},
    "ppo": {"hidden": [16], "horizon": 8},
    "dagger": {"hidden": [16, 16], "batch": 16, "ratio": 1, "capacity": 500, "led": 5},
}


SHOWN: dict[str, dict[str, Any]] = {
    "sacfd": {"steps": 3, "alpha": 0.6, "one_step": 1.0, "pretrain": 5},
    "rlpd": {"layer_norm": True, "share": 0.5, "subset": 2, "critics": 3},
}


@pytest.mark.parametrize("name", SHOWN)
def test_recipes_from_demonstrations_keep_it_too(name: str) -> None:
    """Priorities with two returns and pretraining; half of a batch and a draw of critics."""
    values = {**OFF_POLICY, "demonstrations": "buffer", **SHOWN[name]}
    assert check_learner("sac", values=values).updates > 0
    given = compose([f"learner={name}", "env=reach"], root="train").learner
    assert {k: given[k] for k in SHOWN[name] if k not in ("pretrain", "critics")} == {
        k: v for k, v in SHOWN[name].items() if k not in ("pretrain", "critics")
    }


@pytest.mark.parametrize("name", registry.names("learner"))
def test_an_installed_learner_keeps_the_contract(name: str) -> None:
    """Actions, updates, reports, one course a seed, exact continuation, the policy handed out."""
    report = check_learner(name, values=VALUES.get(name))
    assert report.updates > 0


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
@pytest.mark.parametrize("name", registry.names("learner"))
def test_an_installed_learner_works_on_an_accelerator(name: str) -> None:
    """The same with networks, memory and environments on a GPU, but for bit-equal courses."""
    report = check_learner(name, values=VALUES.get(name), device="cuda")
    assert report.updates > 0


@pytest.mark.parametrize(
    "values",
    [
        {"use_pixels": False},
        {"use_state": False},
        {"use_state": False, "critics_see": "state"},
        {"critics_see": "state"},
    ],
)
def test_a_blind_learner_and_one_that_only_sees_keep_it_too(values: dict[str, Any]) -> None:
    """Either half of the observation may be left out."""
    assert check_learner("visual_sac", values={**VALUES["visual_sac"], **values}).updates > 0


def test_demonstrations_lie_in_every_batch_as_configured() -> None:
    """RLPD draws the share it was told; SAC with demonstrations draws them like the rest."""
    values = {**OFF_POLICY, "demonstrations": "buffer", "share": 0.25}
    assert check_learner("sac", values=values).figures["demonstration_share"] == 0.25
    values = {**OFF_POLICY, "demonstrations": "buffer"}
    assert check_learner("sac", values=values).figures["demonstration_share"] > 0.0


@dataclass(kw_only=True)
class Forgetful(SAC):
    """A learner whose agent does not keep its random state."""

    def start(self, spaces: Any, *, device: str, seed: int) -> Any:
        """Return the agent."""
        return ForgetfulAgent(self, spaces, device, seed)


class ForgetfulAgent(SacAgent):
    """Puts everything back but its generator."""

    def load(self, state: Any) -> None:
        """Keep the generator as it is."""
        before = self.generator.get_state()
        super().load(state)
        self.generator.set_state(before)


@dataclass(kw_only=True)
class Excited(SAC):
    """A learner whose agent acts beyond the bounds."""

    def start(self, spaces: Any, *, device: str, seed: int) -> Any:
        """Return the agent."""
        agent = super().start(spaces, device=device, seed=seed)
        act = agent.act
        agent.act = lambda observation, explore: 1.5 * act(observation, explore=explore)
        return agent


@dataclass(kw_only=True)
class Diarist(SAC):
    """A learner whose agent keeps arrays that grow where the command line expects none."""

    def start(self, spaces: Any, *, device: str, seed: int) -> Any:
        """Return the agent."""
        return DiaristAgent(self, spaces, device, seed)


class DiaristAgent(SacAgent):
    """Keeps a number for each update."""

    def state(self) -> dict[str, Any]:
        """Return the state with them."""
        return {**super().state(), "diary": torch.zeros(self.updates)}


@pytest.mark.parametrize(
    ("cls", "words"),
    [
        (Forgetful, "does not continue identically"),
        (Excited, "acts with shape"),
        (Diarist, r"could not be resumed after a stop: state\.diary.*\n.*entry 'rows'"),
    ],
)
def test_a_breach_of_the_contract_is_found(cls: type, words: str) -> None:
    """A forgotten generator, actions out of bounds and arrays that grow are refused by name."""
    with pytest.raises(ContractError, match=words):
        check_learner(cls, values=OFF_POLICY)
