"""Demonstrations: what goes in comes out, and nothing else comes in."""

from __future__ import annotations

import json
import pickle
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import LogError, MissingExtra, SealsError
from seals.learn.demonstrations.episode import Demonstrations, Episode, Origin, Who
from seals.learn.demonstrations.exchange import write_hdf5, write_minari
from seals.learn.demonstrations.folder import FILE, read, write
from seals.learn.metadata import config_hash

safetensors = pytest.importorskip("safetensors.numpy", reason="the extra learn is not installed")
h5py = pytest.importorskip("h5py", reason="the extra learn is not installed")


def episode(steps: int, *, seed: int, terminated: bool = True, pixels: bool = False) -> Episode:
    """An episode whose every number is different."""
    random = np.random.default_rng(seed)
    last = np.arange(steps) == steps - 1
    images = random.integers(0, 255, (steps + 1, 3, 4, 5), dtype=np.uint8) if pixels else None
    return Episode(
        observation=random.normal(size=(steps + 1, 4)).astype(np.float32),
        action=random.uniform(-1, 1, (steps, 2)).astype(np.float32),
        reward=random.normal(size=steps).astype(np.float32),
        terminated=last & terminated,
        truncated=last & (not terminated),
        success=terminated,
        seed=seed,
        pixels=images,
    )


def some(*, pixels: bool = False) -> Demonstrations:
    """Three episodes of three lengths."""
    origin = Origin(
        env="Toy-v0",
        config_hash=config_hash({"a": 1}),
        who=Who.scripted,
        by="expert",
        observation=("x", "y", "vx", "vy"),
        action=("ax", "ay"),
        rate=25.0,
        config={"a": 1},
    )
    kept = [episode(5, seed=1, pixels=pixels), episode(1, seed=2, pixels=pixels)]
    return Demonstrations(
        origin=origin, episodes=[*kept, episode(7, seed=3, terminated=False, pixels=pixels)]
    )


def assert_same(one: Demonstrations, two: Demonstrations) -> None:
    """Every number and every word is equal."""
    assert one.origin.env == two.origin.env
    assert one.origin.who is two.origin.who
    assert list(one.origin.observation) == list(two.origin.observation)
    assert one.origin.config == two.origin.config
    for a, b in zip(one.episodes, two.episodes, strict=True):
        assert (a.seed, a.success, a.steps) == (b.seed, b.success, b.steps)
        for name in ("observation", "action", "reward", "terminated", "truncated"):
            assert getattr(a, name).dtype == getattr(b, name).dtype
            assert np.array_equal(getattr(a, name), getattr(b, name)), name
        assert (a.pixels is None) == (b.pixels is None)
        if a.pixels is not None and b.pixels is not None:
            assert np.array_equal(a.pixels, b.pixels)


@pytest.mark.parametrize("pixels", [False, True])
def test_the_folder_gives_back_what_it_took(tmp_path: Path, pixels: bool) -> None:
    """It holds every number, flag, seed and word."""
    demos = some(pixels=pixels)
    assert_same(demos, read(write(demos, tmp_path / "inside")))
    metadata = json.loads((tmp_path / "inside" / "card.json").read_text())
    assert metadata["human"] is False
    assert metadata["success"] == [True, True, False]
    assert metadata["returns"][1] == pytest.approx(float(demos.episodes[1].reward[0]))


def test_the_folder_opens_without_us(tmp_path: Path) -> None:
    """The library's own reader finds every array, episode after episode."""
    demos = some(pixels=True)
    data = safetensors.load_file(write(demos, tmp_path / "demos") / FILE)
    assert data["terminated"].nonzero()[0].tolist() == [4, 5]
    assert data["truncated"].nonzero()[0].tolist() == [12]
    second = demos.episodes[1]
    # six observations of the episode before it
    assert np.array_equal(data["observation"][6:8], second.observation)
    assert np.array_equal(data["pixels"][6:8], second.pixels)
    assert np.array_equal(data["action"][5:6], second.action)


def former(demonstrations: Demonstrations, folder: Path) -> None:
    """Write demonstrations as folders of the former format held them, by the real library."""
    tensordict = pytest.importorskip("tensordict", reason="the extra learn is not installed")
    import torch

    rows = demonstrations.transitions()
    flags = {n: rows[n][:, None] for n in ("terminated", "truncated")}
    after = {"observation": rows["next_observation"], "reward": rows["reward"][:, None], **flags}
    now = {"observation": rows["observation"], "action": rows["action"]}
    if "pixels" in rows:
        now["pixels"], after["pixels"] = rows["pixels"], rows["next_pixels"]
    count = [demonstrations.steps]
    data, following = (
        tensordict.TensorDict({k: torch.from_numpy(v.copy()) for k, v in part.items()}, count)
        for part in (now, after)
    )
    data["next"] = following
    write(demonstrations, folder)
    (folder / FILE).unlink()
    data.memmap(str(folder))


@pytest.mark.parametrize("pixels", [False, True])
def test_folders_of_the_former_format_are_read(tmp_path: Path, pixels: bool) -> None:
    """The same episodes come out; a file cut short and mixed steps are refused in words."""
    given = some(pixels=pixels)
    former(given, tmp_path / "old")
    for a, b in zip(given.episodes, read(tmp_path / "old").episodes, strict=True):
        for name in ("observation", "action", "reward", "terminated", "truncated", "pixels"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        assert (a.seed, a.success) == (b.seed, b.success)
    file = tmp_path / "old" / "next" / "observation.memmap"
    whole = file.read_bytes()
    file.write_bytes(whole[16:] + whole[:16])
    with pytest.raises(LogError, match="Steps were lost or mixed"):
        read(tmp_path / "old")
    file.write_bytes(whole[:-4])
    with pytest.raises(LogError, match="The metadata promises"):
        read(tmp_path / "old")


def test_an_hdf5_file_has_the_known_names(tmp_path: Path) -> None:
    """A reader of the common layout finds samples, actions and observations."""
    with h5py.File(write_hdf5(some(), tmp_path / "demos.hdf5")) as file:
        assert file["data"].attrs["total"] == 13
        demo = file["data/demo_2"]
        assert demo.attrs["num_samples"] == 7
        assert demo["actions"].shape == (7, 2)
        assert demo["obs/state"].shape == demo["next_obs/state"].shape == (7, 4)
        assert demo["dones"][:].tolist() == [0] * 6 + [1]
        given = some().episodes[2]
        for name, values in (
            ("obs/state", given.observation[:-1]),
            ("next_obs/state", given.observation[1:]),
            ("actions", given.action),
            ("rewards", given.reward),
            ("terminated", given.terminated),
            ("truncated", given.truncated),
        ):
            assert np.array_equal(demo[name][:], values), name
        assert json.loads(file["data"].attrs["card"])["who"] == "scripted"


def test_transitions_never_cross_episodes() -> None:
    """The step that ends an episode is followed by its own last observation."""
    demos = some(pixels=True)
    rows = demos.transitions()
    assert rows["episode"].tolist() == [0] * 5 + [1] + [2] * 7
    assert np.array_equal(rows["next_observation"][4], demos.episodes[0].observation[-1])
    assert np.array_equal(rows["observation"][5], demos.episodes[1].observation[0])
    assert rows["next_pixels"].shape == (13, 3, 4, 5)


def test_shuffled_actions_keep_everything_else() -> None:
    """The negative control deals the same actions to other steps; the rest stays."""
    demos = some()
    dealt = demos.shuffled(seed=4)
    before, after = demos.transitions(), dealt.transitions()
    assert not np.array_equal(before["action"], after["action"])
    assert np.array_equal(np.sort(before["action"], axis=0), np.sort(after["action"], axis=0))
    # whole actions are dealt, not their columns
    rows = {tuple(row) for row in before["action"].tolist()}
    assert {tuple(row) for row in after["action"].tolist()} == rows
    for name in ("observation", "reward", "terminated", "next_observation"):
        assert np.array_equal(before[name], after[name])
    assert [e.steps for e in demos.first(2).episodes] == [5, 1]
    with pytest.raises(SealsError, match="4 of 3 demonstrations"):
        demos.first(4)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"action": np.zeros((4, 2), np.float32)}, "'observation' has the shape"),
        ({"reward": np.zeros((5, 1), np.float32)}, "'reward' has the shape"),
        ({"reward": np.full(5, np.nan, np.float32)}, "not finite"),
        ({"terminated": np.zeros(5, bool)}, r"ends at steps \[\]"),
        ({"truncated": np.ones(5, bool)}, r"ends at steps \[0, 1, 2, 3\] of 5"),
        ({"pixels": np.zeros((5, 3, 4, 5), np.uint8)}, "'pixels' has the shape"),
    ],
)
def test_an_episode_that_contradicts_itself_is_refused(change: dict[str, Any], words: str) -> None:
    """Shapes, finite values and the one end are checked where an episode is made."""
    good = {**vars(episode(5, seed=1)), **change}
    with pytest.raises(LogError, match=words):
        Episode(**good)


def edit_card(**change: Any) -> Callable[[Path], None]:
    """Return a fault: entries of the metadata replaced."""

    def fault(folder: Path) -> None:
        metadata = json.loads((folder / "card.json").read_text())
        (folder / "card.json").write_text(json.dumps({**metadata, **change}))

    return fault


def edit_arrays(**change: Any) -> Callable[[Path], None]:
    """Return a fault: arrays of the file replaced, or left out by None."""

    def fault(folder: Path) -> None:
        arrays = {**safetensors.load_file(folder / FILE), **change}
        kept = {name: values for name, values in arrays.items() if values is not None}
        safetensors.save_file(kept, folder / FILE)

    return fault


def link_out(folder: Path) -> None:
    """The steps lie somewhere else."""
    outside = folder.parent / "elsewhere"
    shutil.move(folder / FILE, outside)
    (folder / FILE).symlink_to(outside)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (lambda f: (f / "card.json").unlink(), "there is no card.json"),
        (lambda f: (f / "card.json").write_text("{"), "not valid JSON"),
        (lambda f: (f / "card.json").write_text("[" * 200_000), "nested deeper"),
        (lambda f: (f / "card.json").write_text(" " * 2_000_000), "2000000 bytes"),
        (edit_card(format="seals-policy"), "Allowed here: 'seals-demonstrations'"),
        (edit_card(version=2), "version 2"),
        (edit_card(who="robot"), r"who=robot .*\n.*human, scripted"),
        (edit_card(steps=[5, 1]), "2 episodes, 3 outcomes"),
        (edit_card(steps=[5, 1, 10**9]), r"steps\[2\]=.*\n.* to 20,000,000"),
        (edit_card(sizes=[10**9, 2]), "Allowed: .* 4294967296 bytes"),
        (edit_card(steps=[5, 1, -7]), r"steps\[2\]=-7 .*\n.*from 1"),
        (edit_card(steps=[5, True, 7]), r"steps\[1\]=True .*\n.*a whole number"),
        (edit_card(seeds=[1, 2, 10**30]), r"seeds\[2\]=1000.*\n.*from 0 to 9,223"),
        (edit_card(success=[1, 1, 1]), r"success\[0\]=1 .*\n.*true or false"),
        (edit_card(rate="fast"), r"rate=fast .*\n.*a finite number"),
        (edit_card(steps=[5, 2, 6]), r"ends at steps \[0\] of 2"),
        (edit_card(observation=["x"]), "1 names stand for 4 columns"),
        (link_out, "is missing"),
        (lambda f: (f / FILE).unlink(), "is missing"),
        (lambda f: (f / FILE).write_bytes(b"1234"), "must be of the format safetensors"),
        (lambda f: (f / FILE).write_bytes(bytes(30_000)), "30000 bytes"),
        (edit_arrays(reward=None), "'reward' is missing"),
        (edit_arrays(more=np.zeros(3)), "The metadata says: none"),
        (edit_arrays(action=np.zeros((13, 2))), "float64"),
        (edit_arrays(reward=np.zeros((13, 1), np.float32)), r"\(13, 1\)"),
        (edit_arrays(reward=np.full(13, np.nan, np.float32)), "not finite"),
        (edit_arrays(terminated=np.full(13, 2, np.uint8)), r"ends at steps \[0, 1, 2, 3\] of 5"),
    ],
)
def test_strange_folders_are_refused(
    tmp_path: Path, fault: Callable[[Path], object], words: str
) -> None:
    """Each way a folder can be broken or hostile is refused in words, before anything is run."""
    folder = write(some(), tmp_path / "demos")
    fault(folder)
    with pytest.raises(SealsError, match=words) as refusal:
        read(folder)
    assert "\n" in str(refusal.value)


def test_a_pickle_in_a_folder_is_never_opened(tmp_path: Path) -> None:
    """What would run when it is unpickled does not run."""
    mark = tmp_path / "ran"

    class Trap:
        def __reduce__(self) -> tuple[Any, tuple[str]]:
            return (exec, (f"open({str(mark)!r}, 'w').close()",))

    folder = write(some(), tmp_path / "demos")
    (folder / FILE).write_bytes(pickle.dumps(Trap()))
    with pytest.raises(SealsError, match="must be of the format safetensors"):
        read(folder)
    assert not mark.exists()


def test_minari_takes_the_episodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A data set of Minari's gives back every observation, action, reward and end."""
    minari = pytest.importorskip("minari", reason="Minari is not installed: an option")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    demos = some()
    assert write_minari(demos, "seals/toy/scripted-v0").is_dir()
    data = minari.load_dataset("seals/toy/scripted-v0")
    assert (data.total_episodes, data.total_steps) == (3, 13)
    for kept, again in zip(demos.episodes, data.iterate_episodes(), strict=True):
        np.testing.assert_array_equal(kept.observation, again.observations)
        np.testing.assert_array_equal(kept.action, again.actions)
        np.testing.assert_allclose(kept.reward, again.rewards, rtol=1e-6)
        assert kept.terminated.tolist() == again.terminations.tolist()
    with pytest.raises(SealsError, match="id of a data set"):
        write_minari(demos, "two words")


def test_a_missing_minari_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the package the words say what to install, and the way round."""
    monkeypatch.setitem(sys.modules, "minari", None)
    with pytest.raises(MissingExtra, match=r"(?s)pip install minari.*hdf5=FILE"):
        write_minari(some(), "seals/toy-v0")
