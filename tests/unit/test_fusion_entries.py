"""Laws written entry by entry give what they give with whole tensors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from seals.frames import cross

torch = pytest.importorskip("torch", reason="fusing needs torch: pip install 'aam-seals[learn]'")

B = 70
"""Rows of the batch."""
TABLE = torch.linspace(0.0, 5.0, 11)


HELD = torch.zeros(3)
NONE = torch.zeros(0, 3)
WHOLE = torch.tensor([1, 2, 3])
PICK = torch.tensor([True, False, True])


def _written(x: Any) -> Any:
    """A copy of what the law holds, used before and after it is written to."""
    copy = HELD.clone()
    before = copy + x
    copy[:1] = x[0, :1]
    copy.add_(1.0)
    return before, copy + x


def _doubled(matrix: Any) -> Any:
    """The matrix with a diagonal of twos, written in place."""
    matrix.diagonal().fill_(2.0)
    return matrix


LAWS: dict[str, Callable[[Any, Any], Any]] = {
    "another order": lambda x, m: m.permute(2, 0, 1) * 2.0,
    "one more index": lambda x, m: x.unsqueeze(1) + x.unsqueeze(-1),
    "without an index": lambda x, m: x[:, None].squeeze(1) + m[:, :1].squeeze(-2),
    "some places": lambda x, m: m[:, 1:, ::2] - x[:, -1:, None],
    "the last place": lambda x, m: x[:, -1] * m[:, 0, -2],
    "another shape": lambda x, m: m.reshape(B, 9) - m.transpose(1, 2).reshape(B, 9),
    "rows that mix": lambda x, m: (m.reshape(B * 3, 3) * 2.0).reshape(B, 9) + x.repeat(1, 3),
    "one for all": lambda x, m: x.expand(4, B, 3) + torch.ones(4, 1, 1),
    "side by side": lambda x, m: torch.stack((x, x * 2.0, m[:, 0]), dim=1),
    "one after the other": lambda x, m: torch.cat((x, m[:, 1]), dim=0)[B:] * 3.0,
    "blocks of the batch": lambda x, m: torch.cat((x, m[:, 1], x), dim=0).sin(),
    "some rows": lambda x, m: x[3:9] * 2.0,
    "every second row": lambda x, m: x[::2] * 2.0,
    "one row": lambda x, m: x[5] + m[:, 0],
    "one by one": lambda x, m: sum(x.unbind(1)),
    "rows one by one": lambda x, m: x.unbind(0)[4] + x,
    "sums": lambda x, m: m.sum(dim=(1, 2)) + m.sum(dim=2, keepdim=True)[:, 0, 0],
    "sums over the batch": lambda x, m: x.sum(dim=0) + x.mean(dim=0) + x.sum(),
    "counts": lambda x, m: (m > 0.0).sum(dim=1),
    "largest and least": lambda x, m: m.amax(dim=1) - m.amin(dim=(1,), keepdim=True)[:, 0],
    "any and all": lambda x, m: (m > 0.0).any(dim=1) | (m > -1.0).all(dim=2),
    "numbers alone": lambda x, m: x + (torch.arange(3.0) * 2.0 + 1.0).sum() * torch.eye(3)[1],
    "choices": lambda x, m: torch.where(x > 0.0, x, torch.zeros(1)) + torch.where(x < 0.0, 1.0, x),
    "choices known before": lambda x, m: torch.where(torch.eye(3)[0] > 0.0, x, x * 5.0),
    "choices of two types": lambda x, m: torch.where(torch.ones(3) > 0.0, x, x.double()),
    "whole numbers": lambda x, m: x * x.floor().to(torch.int64) + (x > 0.0) * 2,
    "two types": lambda x, m: (x.double() * x[:1, :1] + x, x.float() + x.double()[:, :1]),
    "a table": lambda x, m: TABLE[(x[:, 0].abs() * 3.0).floor().to(torch.int64).clamp(0, 10)],
    "rows with a matrix": lambda x, m: x @ torch.tensor([[0.0, 1.0], [2.0, 0.0], [-1.0, 0.0]]),
    "a matrix with columns": lambda x, m: torch.tensor([[0.0, 2.0, -1.0]]) @ x.T,
    "matrices": lambda x, m: m @ m.transpose(1, 2) @ x[:, :, None],
    "a matrix with matrices": lambda x, m: torch.tensor([[0.0, 1.0, 2.0]] * 3) @ m,
    "empty tensors": lambda x, m: torch.cat((x[:, :0], x, torch.zeros(B, 0)), dim=1),
    "an empty result": lambda x, m: x[:, :0] * 2.0,
    "nothing but numbers": lambda x, m: (torch.zeros(B, 2), torch.full((3,), 2.0), x * 0.0),
    "written over": lambda x, m: _doubled(torch.ones(3, 3)) * m,
    "limits": lambda x, m: x.clamp(-0.5, 0.5).pow(2) + torch.nan_to_num(x / 0.0),
    "a held tensor written over": lambda x, m: _written(x),
    "as many columns as rows": lambda x, m: x[:, 0][None].expand(B, B) * 1.5,
    "every pair": lambda x, m: torch.meshgrid(x[:, 0], x[:, 1], indexing="ij")[1] * 2.0,
    "rows moved on": lambda x, m: torch.cat((x[1:, 0], x[:1, 0])) + x[:, 0],
    "rows moved on, repeated": lambda x, m: torch.cat((x[1:, 0], x[:1, 0])).expand(3, B) * 2.0,
    "rows put together again": lambda x, m: torch.stack([x[k, 0] for k in range(B)]) + x[:, 0],
    "a double without an index": lambda x, m: x.float() * torch.tensor(2.0).double(),
    "two kinds of whole numbers": lambda x, m: x.to(torch.int32) * WHOLE,
    "a whole number chosen": lambda x, m: torch.where(PICK, x.long(), x),
    "a mask chosen": lambda x, m: torch.where(PICK, PICK, x),
    "any of bytes": lambda x, m: ((x > 0.0).to(torch.uint8) * 6).any(dim=1),
    "nothing of doubles": lambda x, m: torch.cat((torch.zeros(0).double(), x[:, 0])),
    "no index to give up": lambda x, m: x.sum().squeeze(0) + x.sum().amax(dim=0) + x,
    "a sum of one number": lambda x, m: x.sum().sum(dim=0) + x,
    "constants without entries": lambda x, m: (NONE * x[0], NONE[None] + x[:, None], x @ NONE.T),
    "two results": lambda x, m: tuple(torch.frexp(x)),
    "many entries": lambda x, m: (x @ torch.ones(3, 400)).sin().sum(dim=1),
}


@pytest.mark.parametrize("name", LAWS)
def test_a_law_gives_the_same_entry_by_entry(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Shapes, types and numbers; without a compiler, which takes no part in it."""
    from seals.tensor_compiler import compile_law

    monkeypatch.setattr("seals.tensor_compiler.fused.compiled", lambda graph, given: graph)
    draw = torch.Generator().manual_seed(0)
    given = torch.randn(B, 3, generator=draw), torch.randn(B, 3, 3, generator=draw)
    other = torch.randn(B, 3, generator=draw), torch.randn(B, 3, 3, generator=draw)
    law = LAWS[name]
    fused = compile_law(law)
    for x, m in (given, other):
        found, expected = fused(x, m), law(x, m)
        if not isinstance(expected, tuple):
            found, expected = (found,), (expected,)
        for one, right in zip(found, expected, strict=True):
            assert one.shape == right.shape
            assert one.dtype == right.dtype
            torch.testing.assert_close(one, right, rtol=1e-5, atol=1e-6, equal_nan=True)


def test_every_entry_is_a_column(monkeypatch: pytest.MonkeyPatch) -> None:
    """No operation between what is given and what is told has more than one index."""
    from seals.tensor_compiler import compile_law

    graphs = []
    monkeypatch.setattr(
        "seals.tensor_compiler.fused.compiled", lambda g, given: graphs.append(g) or g
    )

    def law(x: Any, m: Any) -> Any:
        axis = x / torch.sqrt((x * x).sum(dim=1, keepdim=True))
        turned = (m @ axis[:, :, None])[:, :, 0]
        return torch.cat((turned, cross(axis, turned)), dim=1)

    draw = torch.Generator().manual_seed(1)
    compile_law(law)(torch.randn(B, 3, generator=draw), torch.randn(B, 3, 3, generator=draw))
    names = {str(n.target) for n in graphs[0].graph.nodes if n.op == "call_function"}
    moves = {"aten.select.int", "aten.stack.default", "aten.reshape.default",
             "aten.permute.default", "aten.expand.default"}  # fmt: skip
    sums = {
        f"aten.{x}" for x in ("mul.Tensor", "add.Tensor", "sub.Tensor", "div.Tensor", "neg.default")
    }
    assert names <= moves | sums | {"aten.sqrt.default"}


def test_places_in_memory_are_refused() -> None:
    """A law that counts numbers as they lie in memory is told so: they lie otherwise here."""
    from seals.errors import ConfigError
    from seals.tensor_compiler.tracing import traced

    m = torch.randn(B, 3, 3)
    with pytest.raises(ConfigError, match="depends on the memory layout"):
        traced(lambda x: [(x * 2.0).as_strided((B, 3), (9, 1))], [m])


def test_what_is_drawn_is_not_joined() -> None:
    """Two draws are two, and none is worked out once for all."""
    from seals.tensor_compiler.tracing import traced

    def law(x: Any) -> list[Any]:
        return [torch.rand(3) - torch.rand(3), torch.rand_like(HELD) + x]

    run, x = traced(law, [torch.zeros(B, 3)]), torch.zeros(B, 3)
    one, other = run(x), run(x)
    assert one[0].abs().min() > 0.0
    assert not torch.equal(one[1], other[1])
