from __future__ import annotations

from collections import Counter

import pytest

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.shards import Shard


@pytest.mark.parametrize("count", [1, 2, 7, 1000])
def test_every_run_is_in_one_shard(count: int) -> None:
    runs = list(Study.preset("quick").plan().runs())
    parts = [list(Shard(i, count).of(runs)) for i in range(1, count + 1)]
    assert Counter(run.key for part in parts for run in part) == Counter(run.key for run in runs)
    assert max(map(len, parts)) - min(map(len, parts)) <= 1


@pytest.mark.parametrize("text", ["0/2", "3/2", "1/0", "1", "a/b", "1/2/3", "-1/2", ""])
def test_no_such_shard(text: str) -> None:
    with pytest.raises(StudyError, match="should be i/n"):
        Shard.parse(text)
