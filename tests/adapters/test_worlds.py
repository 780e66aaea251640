from __future__ import annotations

from swarm_logistics_env.adapters.worlds import Buffers


def test_memory_is_used_again_as_zeros_only_when_nobody_holds_it() -> None:
    buffers = Buffers((3, 2))
    first = buffers.zeros()
    where = first.ctypes.data
    first[:] = 1.0
    part = first[1:]
    del first
    others = [buffers.zeros() for _ in range(3)]
    assert where not in [other.ctypes.data for other in others]
    assert (part == 1.0).all()
    del part
    again = buffers.zeros()
    assert again.ctypes.data == where
    assert (again == 0.0).all()


def test_a_caller_that_keeps_everything_gets_new_memory_every_time() -> None:
    buffers = Buffers((3, 2))
    kept = [buffers.zeros() for _ in range(20)]
    assert len({array.ctypes.data for array in kept}) == 20
