from odeform.dataset.index import assign_splits


def test_shares_of_the_splits() -> None:
    labels = assign_splits(200, seed=4)
    assert [labels.count(split) for split in ("train", "val", "test")] == [140, 20, 40]
    assert labels == assign_splits(200, seed=4)
    assert labels != assign_splits(200, seed=5)
    assert labels != sorted(labels)
