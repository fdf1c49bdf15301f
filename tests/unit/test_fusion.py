"""Fused laws give what the laws give, in one piece for each form of what they are given."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import pytest

from seals.arrays import some
from seals.errors import ConfigError
from seals.pytree import filled, form_of, is_tensor, mapped, tensors

torch = pytest.importorskip("torch", reason="fusing needs torch: pip install 'aam-seals[learn]'")


class _Pair(NamedTuple):
    a: Any
    b: Any


def _kept(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Run traced laws as they are, without a compiler, and keep their graphs."""
    graphs: list[Any] = []

    def compiled(graph: Any, given: Any) -> Callable[..., Any]:
        graphs.append(graph)
        return graph

    monkeypatch.setattr("seals.tensor_compiler.fused.compiled", compiled)
    return graphs


def _names(graph: Any) -> list[str]:
    return [str(node.target) for node in graph.graph.nodes if node.op == "call_function"]


def test_nests_keep_their_form() -> None:
    """Named tuples, mappings, numbers and None stay; tensors alone are told and replaced."""
    nest = _Pair(torch.ones(2), {"x": (1.5, None, torch.zeros(1))})
    assert [x.tolist() for x in tensors(nest)] == [[1.0, 1.0], [0.0]]
    other = filled(nest, iter([torch.zeros(2), torch.ones(1)]))
    assert isinstance(other, _Pair)
    assert other.b["x"][:2] == (1.5, None)
    assert [x.tolist() for x in tensors(other)] == [[0.0, 0.0], [1.0]]
    assert mapped(nest, is_tensor) == _Pair(True, {"x": (False, None, True)})


def test_forms_tell_apart_what_must_not_stand_for_one_another() -> None:
    """Shapes, layouts, types, numbers and names count; steps along single places do not."""
    like = form_of((torch.zeros(4, 3), 1.0))
    assert form_of((torch.ones(4, 3), 1.0)) == like
    others = [
        (torch.zeros(3, 4), 1.0),
        (torch.zeros(3, 4).T, 1.0),
        (torch.zeros(4, 3).double(), 1.0),
        (torch.zeros(4, 3), 2.0),
        _Pair(torch.zeros(4, 3), 1.0),
    ]
    assert all(form_of(other) != like for other in others)
    assert form_of(torch.zeros(4, 1)) == form_of(torch.zeros(1, 4).T)
    assert form_of(torch.zeros(4, 0)) == form_of(torch.zeros(0, 4).T)


def test_a_compiled_law_gives_what_the_law_gives() -> None:
    """Nests come back in their form, what is passed on is the very tensor, results agree."""
    from seals.tensor_compiler import compile_law

    turn = torch.tensor([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])

    def law(state: _Pair, step: float) -> _Pair:
        moved = state.a @ turn.T + step * torch.sin(state.a)
        return _Pair(moved, {"same": state.b, "twice": (moved * 2.0, moved)})

    draw = torch.Generator().manual_seed(0)
    given = _Pair(torch.randn(50, 3, generator=draw), torch.ones(50, 1))
    fused = compile_law(law)
    for state in (given, _Pair(given.a + 1.0, given.b)):
        found, expected = fused(state, 0.1), law(state, 0.1)
        assert isinstance(found, _Pair)
        assert found.b["same"] is state.b
        assert found.b["twice"][1] is found.a
        torch.testing.assert_close(found.a, expected.a)
        torch.testing.assert_close(found.b["twice"][0], expected.b["twice"][0])
    assert len(fused._pieces) == 1
    torch.testing.assert_close(fused(given, 0.3).a, law(given, 0.3).a)
    assert len(fused._pieces) == 2


def test_one_tensor_in_two_places_stands_for_two(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was the same at the first call may differ at the next, in results and in passing."""
    from seals.tensor_compiler import compile_law

    _kept(monkeypatch)
    fused = compile_law(lambda pair: (_Pair(pair.a + 1.0, pair.b * 2.0), pair))
    zero = torch.zeros(3)
    assert fused(_Pair(zero, zero))[0].a.tolist() == [1.0] * 3
    found, passed = fused(_Pair(torch.full((3,), 4.0), torch.full((3,), 5.0)))
    assert (found.a[0], found.b[0]) == (5.0, 10.0)
    assert (passed.a[0], passed.b[0]) == (4.0, 5.0)


def test_work_on_constants_is_done_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """What depends on constants alone is a constant; small matrices become sums without zeros."""
    from seals.tensor_compiler import compile_law

    graphs = _kept(monkeypatch)
    matrix = torch.tensor([[0.0, 2.0], [1.0, 0.0]])

    def law(x: Any) -> Any:
        return x @ (matrix.T.sin() * 0.0 + matrix), x @ matrix

    x = torch.randn(70, 2, generator=torch.Generator().manual_seed(1))
    for found, expected in zip(compile_law(law)(x), law(x), strict=True):
        torch.testing.assert_close(found, expected)
    names = _names(graphs[0])
    assert not any("mm" in name or "sin" in name or "add" in name for name in names)
    # two products of one constant each, of which one entry is 1, and equals are joined
    assert names.count("aten.mul.Tensor") == 1


def test_large_constants_are_kept_where_many_operations_lead_to_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is cheaply made is made again and again; one number for many is not kept many times."""
    from seals.tensor_compiler import compile_law

    graphs = _kept(monkeypatch)
    rows = torch.linspace(0.0, 1.0, 9000)[:, None]
    deep = rows
    for _ in range(8):
        deep = deep + torch.sin(deep)

    def law(x: Any) -> Any:
        found = rows
        for _ in range(8):
            found = found + torch.sin(found)
        nothing = found * 0.0
        return x + (rows + 1.0), x * found[:, 0:1], x - nothing

    x = torch.ones(9000, 1)
    found = compile_law(law)(x)
    for one, other in zip(found, (x + rows + 1.0, x * deep, x), strict=True):
        torch.testing.assert_close(one, other)
    names = _names(graphs[0])
    assert not any("sin" in name for name in names)
    # one more than each row, and that to what was given; what is nothing is not taken away
    assert names.count("aten.add.Tensor") == 2
    assert not any("sub" in name for name in names)


def test_numbers_that_rows_hold_for_themselves_are_counted() -> None:
    """Twice what each of 32 rows holds itself, once what all of them share, and none given."""
    pytest.importorskip("torch", reason="a compiled law needs torch")
    import torch

    from seals.tensor_compiler.fused import held_by_row
    from seals.tensor_compiler.tracing import traced

    own, shared, rows = torch.rand(32, 2), torch.rand(3), torch.rand(32, 3)

    def law(x: torch.Tensor) -> list[torch.Tensor]:
        return [x[:, 0] * own[:, 0] + own[:, 1] * shared[2], x[:, 1] * shared[0]]

    assert held_by_row(traced(law, [rows]), [rows]) == 2
    assert held_by_row(traced(lambda x: [x * 2.0], [torch.tensor(1.0)]), [torch.tensor(1.0)]) == 0


def test_many_small_matrices_are_written_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their products are sums; those of large matrices stay calls."""
    from seals.tensor_compiler import compile_law

    graphs = _kept(monkeypatch)
    draw = torch.Generator().manual_seed(2)
    a, b = (torch.randn(80, 3, 3, generator=draw) for _ in range(2))
    torch.testing.assert_close(compile_law(torch.matmul)(a, b), a @ b)
    large = torch.randn(80, 9, 9, generator=draw)
    torch.testing.assert_close(compile_law(torch.matmul)(large, large), large @ large)
    assert "aten.bmm.default" not in _names(graphs[0])
    assert "aten.bmm.default" in _names(graphs[1])


def test_what_is_written_in_place_is_as_the_law_says(monkeypatch: pytest.MonkeyPatch) -> None:
    """Equal beginnings of which one is written over are not taken for the same."""
    from seals.tensor_compiler import compile_law

    _kept(monkeypatch)

    def law(x: Any) -> Any:
        one, other = torch.zeros(3, 2), torch.zeros(3, 2)
        one[:, 0] = x[:, 0]
        return one + x, other + x

    x = torch.ones(3, 2)
    for found, expected in zip(compile_law(law)(x), law(x), strict=True):
        assert torch.equal(found, expected)


def test_a_repeated_law_is_one_piece_of_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """Called five times it is followed once; alone it stays as it is."""
    from seals.tensor_compiler import compile_law

    graphs = _kept(monkeypatch)

    @partial(compile_law, nested=True)
    def once(state: _Pair) -> _Pair:
        return _Pair(state.a * 0.5 + 1.0, state.b)

    def law(state: _Pair) -> _Pair:
        for _ in range(5):
            state = once(state)
        return state

    state = _Pair(torch.arange(4.0), torch.zeros(1))
    alone = once(state)
    assert not graphs
    assert alone.a.tolist() == [1.0, 1.5, 2.0, 2.5]
    found = compile_law(law)(state)
    torch.testing.assert_close(found.a, law(state).a)
    assert found.b is state.b
    assert len(graphs) == 2
    assert _names(graphs[1]).count("seals.fused.default") == 5


def test_what_asks_whether_any_takes_one_way_for_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Within a fused law the answer is yes, whatever the numbers are."""
    from seals.tensor_compiler import compile_law

    _kept(monkeypatch)

    def law(x: Any) -> Any:
        return torch.where(x > 0.0, x * 2.0, x) if some(x > 0.0) else x

    fused = compile_law(law)
    assert fused(torch.tensor([-1.0, -2.0])).tolist() == [-1.0, -2.0]
    assert fused(torch.tensor([-1.0, 3.0])).tolist() == [-1.0, 6.0]


def test_a_law_that_asks_for_a_number_is_refused() -> None:
    """The place is told, and the way out."""
    from seals.tensor_compiler import compile_law

    def law(x: Any) -> Any:
        return x * 2.0 if float(x.sum()) > 0.0 else x

    with pytest.raises(ConfigError, match=r"test_fusion, line \d+, branches on the value"):
        compile_law(law)(torch.ones(3))


def test_a_compiler_that_fails_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its first line, what it needs, and what to leave out."""
    from seals.tensor_compiler import compile_law

    said = ["no working C++ compiler\nmore"]

    def broken(graph: Any, given: Any, options: Any) -> Any:
        raise RuntimeError(*said)

    monkeypatch.setattr("torch._inductor.compile", broken)
    with pytest.raises(ConfigError, match=r"no working C\+\+ compiler\n.*g\+\+"):
        compile_law(torch.sin)(torch.ones(3))
    said.clear()
    with pytest.raises(ConfigError, match=r"failed: RuntimeError\n"):
        compile_law(torch.sin)(torch.ones(3))
