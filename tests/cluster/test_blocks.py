"""Which device renders which samples: every sample once, whatever devices do."""

import random

import pytest

from clpt.cluster.blocks import Blocks, WorkerRecord


def joined(blocks, *names):
    for name in names:
        blocks.join(name, WorkerRecord())
    return blocks


def test_one_worker_gets_all_samples_in_order():
    blocks = joined(Blocks(100), "a")
    sizes, at = [], 0
    while not blocks.done:
        block = blocks.take("a")
        assert block.start == at
        at = block.stop
        sizes.append(len(block))
        blocks.finish("a", len(block) / 20)
    assert blocks.taken == ((0, 100),)
    assert sizes[:3] == [1, 3, 9]  # grows to a second's samples
    assert max(sizes) <= 20 and sizes[-1] <= 2  # and shrinks at the end, to a tenth
    assert blocks.workers["a"].rate == pytest.approx(20)


def test_what_was_taken_is_not_done_again():
    blocks = joined(Blocks(10, ((2, 4), (6, 7))), "a")
    done = []
    while not blocks.done:
        block = blocks.take("a")
        done += block
        blocks.finish("a", 1.0)
    assert done == [0, 1, 4, 5, 7, 8, 9]


def test_a_lost_workers_blocks_go_to_others():
    blocks = joined(Blocks(2), "a", "b")
    lost = blocks.take("a")
    blocks.take("b")
    blocks.finish("b", 1.0)
    blocks.lose("a")
    assert blocks.take("b") == lost
    blocks.finish("b", 1.0)
    assert blocks.done and blocks.taken == ((0, 2),)


def test_a_slow_worker_leaves_the_last_samples_to_others():
    """As long as there are others."""
    blocks = joined(Blocks(12), "slow", "fast")
    blocks.take("slow")
    blocks.take("fast")
    blocks.finish("fast", 0.1)
    blocks.finish("slow", 1.0)  # ten left, which take the fast one a second
    assert blocks.take("slow") == range(2, 3)
    blocks.finish("slow", 1.0)
    assert blocks.take("fast").start == 3
    assert blocks.take("slow") is None
    blocks.lose("fast")
    assert blocks.take("slow").start == 3


@pytest.mark.parametrize("seed", range(20))
def test_every_sample_is_taken_once_whatever_happens(seed):
    """Workers of random speeds, of which some fail."""
    chance = random.Random(seed)
    total = chance.randint(1, 400)
    names = [f"w{i}" for i in range(chance.randint(2, 12))]
    blocks = joined(Blocks(total), *names)
    speeds = {name: chance.uniform(1, 50) for name in names}
    flying: dict[str, tuple[range, float]] = {}
    taken: list[int] = []
    now = 0.0
    while not blocks.done:
        now += 0.25
        assert now < 1e5
        for name in list(blocks.workers):
            if name not in flying:
                block = blocks.take(name)
                if block is not None:
                    flying[name] = block, now
        for name, (block, since) in list(flying.items()):
            if chance.random() < 0.01 and name != "w0":
                del flying[name]
                blocks.lose(name)
            elif now - since >= len(block) / speeds[name]:
                del flying[name]
                blocks.finish(name, now - since)
                taken += block
    assert sorted(taken) == list(range(total)) and blocks.taken == ((0, total),)
