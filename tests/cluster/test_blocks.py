"""Who renders which samples: every sample once, whatever workers do."""

import random

import pytest

from clpt.cluster.blocks import MOST_FAILURES, Block, Blocks, Outcome
from clpt.errors import ClusterError


def taken(blocks):
    assert blocks.done
    return blocks.taken


def test_one_worker_gets_all_samples_in_order():
    blocks = Blocks(100)
    blocks.join("a")
    now, sizes, at = 0.0, [], 0
    while not blocks.done:
        block = blocks.take("a", now)
        assert block.first == at
        at, now = block.end, now + block.samples / 20
        sizes.append(block.samples)
        assert blocks.finish("a", block, now) is Outcome.ADD
    assert blocks.taken == ((0, 100),)
    assert sizes[:3] == [1, 3, 9]  # grows to a second's samples
    assert max(sizes) <= 20 and sizes[-1] <= 2  # and shrinks at the end, to a tenth
    assert blocks.workers["a"].rate == pytest.approx(20)


def test_what_was_taken_is_not_done_again():
    blocks = Blocks(10, ((2, 4), (6, 7)))
    blocks.join("a")
    done = []
    while not blocks.done:
        block = blocks.take("a", 0.0)
        done += range(block.first, block.end)
        blocks.finish("a", block, 0.0, seconds=1.0)
    assert done == [0, 1, 4, 5, 7, 8, 9]


def test_a_longer_end_goes_on():
    blocks = Blocks(1)
    blocks.join("a")
    blocks.finish("a", blocks.take("a", 0.0), 1.0)
    assert blocks.done and blocks.take("a", 1.0) is None
    blocks.extend(2)
    assert not blocks.done and blocks.take("a", 1.0).first == 1


def test_closing_waits_for_what_is_on_its_way():
    blocks = Blocks(8)
    blocks.join("a")
    block = blocks.take("a", 0.0)
    blocks.close()
    assert not blocks.done and blocks.take("a", 0.0) is None
    blocks.finish("a", block, 1.0)
    assert blocks.done and blocks.taken == ((0, 1),)


def test_a_lost_workers_blocks_go_to_others():
    blocks = Blocks(2)
    blocks.join("a"), blocks.join("b")
    lost = blocks.take("a", 0.0)
    blocks.finish("b", blocks.take("b", 0.0), 1.0)
    assert blocks.lose("a") == [lost] and blocks.lost == 1
    assert blocks.take("b", 1.0) == lost
    blocks.finish("b", lost, 2.0)
    assert taken(blocks) == ((0, 2),)


def test_a_block_has_one_worker_where_films_cannot_be_dropped():
    """Then a slow worker leaves the last samples to others, as long as there are others."""
    blocks = Blocks(12, copies=1)
    blocks.join("slow"), blocks.join("fast")
    first = blocks.take("slow", 0.0)
    blocks.finish("fast", blocks.take("fast", 0.0), 0.1)
    blocks.finish("slow", first, 1.0)  # ten left, which take the fast one a second
    assert blocks.take("slow", 1.0) == Block(2, 2, 3)
    assert blocks.take("fast", 1.0).first == 3
    assert blocks.take("slow", 99.0) is None and not blocks.repeated
    blocks.lose("fast")
    assert blocks.take("slow", 99.0).first == 3


def test_a_slow_workers_block_is_begun_by_another_and_added_once():
    blocks = Blocks(2, seconds=1.0)
    blocks.join("slow"), blocks.join("b")
    block = blocks.take("slow", 0.0)
    blocks.finish("b", blocks.take("b", 0.0), 1.0)
    assert blocks.take("b", 1.1) is None  # not yet
    assert blocks.take("b", 2.0) == block and blocks.repeated == 1
    assert blocks.take("b", 9.0) is None  # it has it already
    assert blocks.finish("b", block, 3.0) is Outcome.ADD
    assert blocks.finish("slow", block, 4.0) is Outcome.DROP
    assert blocks.dropped == 1 and taken(blocks) == ((0, 2),)


def test_a_block_that_fails_goes_to_others_and_ends_the_render_at_last():
    blocks = Blocks(1)
    blocks.join("a"), blocks.join("b")
    block = blocks.take("a", 0.0)
    blocks.fail("a", block, "out of memory")
    assert blocks.take("a", 0.0) is None  # b has not tried
    assert blocks.take("b", 0.0) == block
    blocks.fail("b", block, "out of memory")
    assert blocks.take("a", 0.0) == block  # all have
    with pytest.raises(ClusterError, match=f"samples 0 to 0 failed {MOST_FAILURES} times.*memory"):
        blocks.fail("a", block, "out of memory")


def compared(**films):
    """Let workers do one block that is compared; return the blocks and what became of the films."""
    blocks = Blocks(1, check_every=1)
    for worker in films:
        blocks.join(worker)
    outcomes = []
    for worker, film in films.items():
        block = blocks.take(worker, 0.0)
        if block is not None:
            outcomes.append(blocks.finish(worker, block, 1.0, digest=film))
    return blocks, outcomes


def test_equal_films_are_added_once():
    blocks, outcomes = compared(a="1", b="1")
    assert outcomes == [Outcome.HOLD, Outcome.ADD] and taken(blocks) == ((0, 1),)


def test_of_three_films_the_one_that_differs_is_refused():
    blocks, outcomes = compared(a="1", liar="2", c="1")
    assert outcomes == [Outcome.HOLD, Outcome.HOLD, Outcome.ADD]
    assert list(blocks.refused) == ["liar"] and "wrong" in blocks.refused["liar"]
    assert taken(blocks) == ((0, 1),)


def test_two_that_differ_end_the_render():
    with pytest.raises(ClusterError, match="a and b have different films of samples 0 to 0"):
        compared(a="1", b="2")


def test_where_films_differ_a_worker_that_gets_ready_is_waited_for():
    blocks = Blocks(1, check_every=1)
    for worker in "abc":
        blocks.expect(worker)
    blocks.join("a"), blocks.join("b")
    for worker in "ab":
        block = blocks.take(worker, 0.0)
        assert blocks.finish(worker, block, 1.0, digest=worker) is Outcome.HOLD
    assert blocks.take("a", 2.0) is None  # c does it
    blocks.join("c")
    assert blocks.take("c", 3.0) == block
    assert blocks.finish("c", block, 4.0, digest="a") is Outcome.ADD
    assert list(blocks.refused) == ["b"]


def test_where_films_differ_and_nobody_comes_the_render_ends():
    blocks = Blocks(1, check_every=1)
    for worker in "abc":
        blocks.expect(worker)
    blocks.join("a"), blocks.join("b")
    for worker in "ab":
        blocks.finish(worker, blocks.take(worker, 0.0), 1.0, digest=worker)
    blocks.refuse("c", "it has no disk")
    block = blocks.take("a", 2.0)
    with pytest.raises(ClusterError, match="a and b have different films of samples 0 to 0"):
        blocks.finish("a", block, 3.0, digest="a")


def test_films_of_other_kinds_are_not_compared():
    blocks = Blocks(2, check_every=1)
    blocks.join("cpu", "cpu"), blocks.join("gpu", "gpu")
    for worker in ("cpu", "gpu"):
        assert blocks.finish(worker, blocks.take(worker, 0.0), 1.0, digest=worker) is Outcome.ADD


def test_a_worker_that_stays_alone_is_believed_if_it_agrees_with_itself():
    blocks = Blocks(1, check_every=1)
    blocks.join("a"), blocks.join("b")
    block = blocks.take("a", 0.0)
    assert blocks.finish("a", block, 1.0, digest="1") is Outcome.HOLD
    assert blocks.take("b", 1.0) == block
    blocks.lose("b")
    assert blocks.take("a", 2.0) == block
    assert blocks.finish("a", block, 3.0, digest="1") is Outcome.ADD


@pytest.mark.parametrize("seed", range(40))
def test_every_sample_is_added_once_whatever_happens(seed):
    """Workers of random speeds that die, fail, hang and lie: the samples are those of one."""
    chance = random.Random(seed)
    total = chance.randint(1, 400)
    blocks = Blocks(total, seconds=2.0, check_every=chance.choice([0, 1, 5]))
    names = [f"w{i}" for i in range(chance.randint(2, 12))]
    liar = names[0] if len(names) > 3 else None
    for name in names:
        blocks.join(name)
    flying: dict[tuple[str, Block], float] = {}
    added: list[int] = []
    now, failures = 0.0, {}
    while not blocks.done:
        now += 0.25
        assert now < 1e5
        for name in list(blocks.workers):
            if any(worker == name for worker, _ in flying):
                continue
            block = blocks.take(name, now)
            if block is not None:
                slow = 20.0 if chance.random() < 0.05 else 1.0
                flying[name, block] = now + slow * block.samples / chance.uniform(1, 50)
        for (name, block), ends in list(flying.items()):
            if chance.random() < 0.01 and name != "w1":
                del flying[name, block]
                blocks.lose(name)
                blocks.join(name)  # another process of its name
            elif now >= ends:
                del flying[name, block]
                if chance.random() < 0.02 and failures.get(block, 0) < 2:
                    failures[block] = failures.get(block, 0) + 1
                    blocks.fail(name, block, "chance")
                    continue
                digest = f"wrong{name}" if name == liar else str(block.number)
                outcome = blocks.finish(name, block, now, digest=digest)
                if outcome is Outcome.ADD:
                    added += range(block.first, block.end)
    assert sorted(added) == list(range(total)) and blocks.taken == ((0, total),)
