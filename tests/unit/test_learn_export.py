"""Policies as ONNX files: they act as the policy does, and what cannot be exported is said."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.errors import SealsError
from seals.learn import export
from seals.learn.policy import load_policy, save_policy

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")
onnx = pytest.importorskip("onnx", reason="needs aam-seals[export]")
onnxruntime = pytest.importorskip("onnxruntime", reason="needs aam-seals[export]")

PIXELS = {
    "shape": [3, 20, 20],
    "channels": 4,
    "strides": [2, 1],
    "features": 6,
    "use_pixels": True,
    "use_state": True,
    "columns": [0, 2, 3],
}


def saved(folder: Path, **more: Any) -> Path:
    """Save a policy with random weights and a normaliser far from one."""
    from seals.learn.networks import actor_of, description

    torch.manual_seed(3)
    network = description(observation=5, action=2, hidden=[8, 8], **more)
    actor = actor_of(network)
    tensors = actor.state_dict()
    for key in tensors:
        if key.endswith("running_mean"):
            tensors[key] += torch.arange(5.0)
        if key.endswith("running_var"):
            tensors[key] *= torch.linspace(0.01, 9.0, 5)
    metadata = {"env": "Toy-v0", "observation": list("abcde"), "action": ["x", "y"]}
    return save_policy(folder / "policy", network=network, tensors=tensors, metadata=metadata)


@pytest.mark.parametrize(
    ("more", "inputs"),
    [
        ({"layer_norm": True}, ["observation"]),
        ({"normalise": False, "squash": "clip"}, ["observation"]),
        ({"pixels": PIXELS}, ["state", "pixels"]),
        ({"pixels": {**PIXELS, "use_state": False}}, ["pixels"]),
    ],
    ids=["dense", "clipped", "visual", "images alone"],
)
def test_the_file_acts_as_the_policy(
    more: dict[str, Any], inputs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Any number of raw observations gives the policy's actions to 1e-5, by ONNX Runtime."""
    folder, out = saved(tmp_path, **more), tmp_path / "new" / "p.onnx"
    assert main(["export", f"policy={folder}", f"out={out}"]) == 0
    assert "actions differ by" in capsys.readouterr().out
    session = onnxruntime.InferenceSession(str(out), providers=["CPUExecutionProvider"])
    assert [one.name for one in session.get_inputs()] == inputs
    properties = session.get_modelmeta().custom_metadata_map
    assert json.loads(properties["observation"]) == list("abcde")
    policy, rng = load_policy(folder), np.random.default_rng(1)
    for count in (1, 7):
        seen: dict[str, Any] = {
            "observation": rng.normal(0.0, 30.0, (count, 5)).astype(np.float32),
            "state": rng.normal(0.0, 3.0, (count, 5)).astype(np.float32),
            "pixels": rng.integers(0, 256, (count, 3, 20, 20), dtype=np.uint8),
        }
        found = session.run(["action"], {name: seen[name] for name in inputs})[0]
        given = {name: torch.as_tensor(seen[name]) for name in inputs}
        wanted = policy.act(given.get("observation", given)).numpy()
        assert found.shape == (count, 2)
        np.testing.assert_allclose(found, wanted, atol=1e-5)


def test_a_shipped_policy_is_exported(tmp_path: Path) -> None:
    """The crab's policy, by its name."""
    assert main(["export", "policy=crab/walk", f"out={tmp_path / 'walk.onnx'}"]) == 0
    model = onnx.load(str(tmp_path / "walk.onnx"))
    facts = {one.key: json.loads(one.value) for one in model.metadata_props}
    assert facts["env"] == "crab_walk"
    assert model.graph.input[0].type.tensor_type.shape.dim[1].dim_value == len(facts["observation"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["policy=crab/wlak"], "Did you mean 'crab/walk'"),
        (["policy=crab/walk", "format=onx"], "Did you mean 'onnx'"),
        (["policy=crab/walk", "out=walk.pt"], "Use out=walk.onnx"),
        (["policy=crab/walk", "out=there.onnx"], "add replace=true"),
        (["policy=broken"], "It must be of the format safetensors"),
        (["policy=other"], "weights and metadata do not match"),
    ],
)
def test_what_cannot_be_exported_is_refused(
    words: list[str],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Exit code 2 and two lines; no file is written or touched."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.onnx").write_text("mine")
    broken = saved(tmp_path).rename(tmp_path / "broken")
    (broken / "policy.safetensors").write_bytes(b"\x00" * 100)
    other = saved(tmp_path).rename(tmp_path / "other")
    card = json.loads((other / "card.json").read_text())
    card["network"]["hidden"] = [8, 9]
    (other / "card.json").write_text(json.dumps(card))
    assert main(["export", *words]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert said in lines[0] + lines[1]
    assert [path.name for path in tmp_path.glob("*.onnx")] == ["there.onnx"]
    assert (tmp_path / "there.onnx").read_text() == "mine"


def test_a_file_that_acts_differently_is_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The comparison can fail: with weights that are others in the graph it does."""
    policy, true = load_policy(saved(tmp_path)), export._traced

    def bent(*given: Any) -> bytes:
        content = true(*given)
        with torch.no_grad():
            policy.network[-2][-1].bias += 1e-3
        return content

    monkeypatch.setattr(export, "_traced", bent)
    with pytest.raises(SealsError, match="differ from those of the policy by"):
        export.onnx_of(policy)
