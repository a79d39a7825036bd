"""Pictures by number, and a DataLoader of PyTorch where it is installed."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from clpt import dataset
from clpt.errors import SceneError
from tests.dataset.test_dataset import HEIGHT, WIDTH, scene


@pytest.fixture
def pictures():
    loaded = dataset.Pictures(scene, 3, spp=2, seed=4)
    yield loaded
    loaded.close()


def same(one, other) -> bool:
    return one.keys() == other.keys() and all(
        np.array_equal(one[name], other[name]) for name in one
    )


def test_a_picture_is_that_of_its_number(pictures):
    """In any order, after pickling, and as `pictures` has it."""
    last = pictures[2]
    assert len(pictures) == 3 and last["index"] == 2
    assert same(pictures[-1], last)
    assert same(pickle.loads(pickle.dumps(pictures))[2], last)
    (picture,) = dataset.pictures(scene, [2], spp=2, seed=4)
    assert np.array_equal(picture.image, last["image"])
    assert np.array_equal(picture.truth.instances, last["instances"])
    assert last["depth"].shape == (HEIGHT, WIDTH) and last["depth"].dtype == np.float32
    assert last["normal"].shape == (HEIGHT, WIDTH, 3) and last["normal"].dtype == np.float32
    with pytest.raises(IndexError, match="picture 3 of 3"):
        pictures[3]
    with pytest.raises(SceneError, match="count"):
        dataset.Pictures(scene, -1)
    assert set(dataset.Pictures(scene, 1, spp=1, truth="none")[0]) == {"index", "image"}


def test_tensors_share_the_memory_of_a_picture(pictures):
    torch = pytest.importorskip("torch")
    picture = pictures[0]
    for name in ("image", "depth", "normal", "instances"):
        tensor = torch.from_dlpack(picture[name])
        assert tensor.data_ptr() == picture[name].ctypes.data, name
        assert tensor.is_contiguous() and tuple(tensor.shape) == picture[name].shape
    tensor = torch.from_dlpack(picture["image"])
    tensor *= 2.0
    assert np.array_equal(picture["image"], tensor.numpy())


def test_a_loader_takes_batches_in_any_order(pictures):
    torch = pytest.importorskip("torch")
    order = torch.utils.data.SequentialSampler(range(3))
    loader = torch.utils.data.DataLoader(pictures, batch_size=2, sampler=order)
    batches = list(loader)
    assert [batch["index"].tolist() for batch in batches] == [[0, 1], [2]]
    assert batches[0]["image"].shape == (2, HEIGHT, WIDTH, 3)
    assert batches[0]["image"].dtype == torch.float32
    assert np.array_equal(batches[1]["image"][0].numpy(), pictures[2]["image"])
    mixed = torch.utils.data.DataLoader(pictures, shuffle=True, batch_size=None)
    assert sorted(int(picture["index"]) for picture in mixed) == [0, 1, 2]


@pytest.mark.slow
def test_workers_of_a_loader_have_renderers_of_their_own(pictures):
    torch = pytest.importorskip("torch")
    expected = pictures[1]["image"]
    loader = torch.utils.data.DataLoader(
        pictures, batch_size=None, num_workers=2, multiprocessing_context="spawn"
    )
    found = {int(picture["index"]): picture["image"].numpy() for picture in loader}
    assert sorted(found) == [0, 1, 2] and np.array_equal(found[1], expected)
