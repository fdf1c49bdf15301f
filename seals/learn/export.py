"""``seals export``: writes a policy as an ONNX file."""

from __future__ import annotations

import io
import json
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.errors import ConfigError, SealsError, optional_import, refuse_absent, refuse_unlisted
from seals.field_roles import roles
from seals.file_names import refuse_taken
from seals.learn.policy import NetworkPolicy, load_policy
from seals.learn.shipped import policy_folder
from seals.logs.atomic import write_bytes

if TYPE_CHECKING:
    from torch import Tensor

FORMATS = ("onnx",)
CLOSE = 1e-5
"""Largest difference between the actions of the file and of the policy [1]."""
OPSET = 17
"""Version of the operators: the first with layer normalisation."""
_ROWS = 64
"""Random observations on which both are compared."""


@roles(data="name format", read="policy", write="out", permission="replace")
@dataclass(kw_only=True)
class ExportSettings:
    """Settings of ``seals export``.

    Args:
        name: of the export, part of the name of Hydra's own folder.
        policy: folder of a trained policy, or ``ROBOT/POLICY`` of a shipped policy.
        format: format of the file: ``onnx``.
        out: file to write.
        replace: whether an existing file may be overwritten.
    """

    name: str = "export"
    policy: str | None = None
    format: str = "onnx"
    out: str = "policy.onnx"
    replace: bool = False


def execute(config: Any) -> int:
    """Export the policy of a composed configuration.

    Args:
        config: with the keys of `ExportSettings`.

    Raises:
        SealsError: something cannot be used, or the file would act differently.
    """
    refuse_unlisted(str(config.format), FORMATS, f"format={config.format} is not known")
    out = Path(str(config.out))
    if out.suffix != ".onnx":
        raise ConfigError(f"out={out} is not the name of an ONNX file.\nUse out={out.stem}.onnx")
    refuse_taken(out, key="out", replace=config.replace and out.is_file())
    refuse_absent(config.policy or None, "policy", "seals export policy=FOLDER")
    policy = load_policy(policy_folder(str(config.policy)))
    content, difference = onnx_of(policy)
    out.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(out, content)
    print(f"{out}: {len(content)} bytes; actions differ by {difference:.1g} at most")
    return 0


def onnx_of(policy: NetworkPolicy) -> tuple[bytes, float]:
    """Return a policy as the content of an ONNX file, checked by ONNX Runtime.

    Inputs are ``observation`` (N, d) of real numbers, or those of ``state`` (N, d) and ``pixels``
    (N, C, H, W) uint8 that the policy looks at; output is ``action`` (N, a). Normalisation of
    observations is part of it. Its metadata hold the names of all numbers.

    Returns:
        The content, and the largest difference of an action on random observations.

    Raises:
        MissingExtra: onnx or onnxruntime is not installed.
        SealsError: the file acts differently.
    """
    with optional_import(
        "format=onnx needs onnx and onnxruntime", "Install them: pip install 'aam-seals[export]'"
    ):
        import onnx
        import onnxruntime
    network = policy.metadata["network"]
    inputs = _random_inputs(policy, network)
    content = _traced(policy, inputs)
    model = onnx.load_from_string(content)
    facts = {k: policy.metadata.get(k) for k in ("env", "observation", "action", "config_hash")}
    onnx.helper.set_model_props(model, {k: json.dumps(v) for k, v in facts.items()})
    onnx.checker.check_model(model)
    content = model.SerializeToString()
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    found = session.run(None, {name: x.numpy() for name, x in inputs.items()})[0]
    wanted = policy.act(_observation(inputs)).numpy()
    difference = float(np.abs(found - wanted).max())
    if not difference <= CLOSE:
        raise SealsError(
            f"the actions of the ONNX file differ from those of the policy by {difference:.3g}.\n"
            f"Allowed: {CLOSE:g}. No file was written; try another version of onnxruntime."
        )
    return content, difference


def _traced(policy: NetworkPolicy, inputs: Mapping[str, Tensor]) -> bytes:
    """Return the graph of a policy, traced on two of the observations."""
    import torch

    names = list(inputs)

    class Named(torch.nn.Module):
        """Policy whose inputs are tensors in place of a mapping."""

        def __init__(self) -> None:
            super().__init__()
            self.actor = policy.network

        def forward(self, *values: Tensor) -> Any:
            return self.actor(_observation(dict(zip(names, values, strict=True))))

    file: Any = io.BytesIO()
    with warnings.catch_warnings(), torch.no_grad():
        # the newer exporter takes ten times as long, and packages of its own
        warnings.filterwarnings("ignore", category=DeprecationWarning)
        # sizes of pictures become constants, which they are
        warnings.filterwarnings("ignore", message=".*Python|.*Tensor", module="torch|seals")
        torch.onnx.export(
            Named().eval(),
            tuple(x[:2] for x in inputs.values()),
            file,
            dynamo=False,
            opset_version=OPSET,
            input_names=names,
            output_names=["action"],
            dynamic_axes={name: {0: "N"} for name in (*names, "action")},
        )
    return file.getvalue()


def _random_inputs(policy: NetworkPolicy, network: Mapping[str, Any]) -> dict[str, Tensor]:
    """Return observations about those of the training, some far outside of them."""
    import torch

    chance = torch.Generator().manual_seed(0)
    numbers = torch.randn((_ROWS, int(network["observation"])), generator=chance)
    tensors = policy.network.state_dict()
    means = [x for key, x in tensors.items() if key.endswith("running_mean")]
    sizes = [x for key, x in tensors.items() if key.endswith("running_var")]
    if means:
        wide = torch.linspace(0.1, 20.0, _ROWS)[:, None]
        numbers = means[0] + wide * numbers * sizes[0].sqrt()
    if network["kind"] == "mlp":
        return {"observation": numbers}
    pixels = network["pixels"]
    image = torch.randint(0, 256, (_ROWS, *pixels["shape"]), generator=chance, dtype=torch.uint8)
    found = {"state": numbers} if pixels["use_state"] else {}
    return found | ({"pixels": image} if pixels["use_pixels"] else {})


def _observation(inputs: Mapping[str, Any]) -> Any:
    return inputs["observation"] if "observation" in inputs else dict(inputs)
