"""Clocks: mission time may be warped or virtual, wall time never is."""

import pytest

from pymoos_lite.core.clock import RealClock, VirtualClock, check_warp


def test_virtual_time_moves_only_when_told():
    clock = VirtualClock(start=100.0)
    assert (clock.now(), clock.wall()) == (100.0, 0.0)
    clock.advance_to(130.0)
    assert (clock.now(), clock.wall()) == (130.0, 30.0)
    with pytest.raises(ValueError, match="backwards"):
        clock.advance_to(129.0)


def test_mission_time_is_warped_and_wall_time_is_not():
    clock = RealClock(warp=10.0)
    wall, now = clock.wall(), clock.now()
    while clock.wall() - wall < 0.01:
        pass
    elapsed_wall = clock.wall() - wall
    assert clock.now() - now == pytest.approx(10.0 * elapsed_wall, rel=0.2)
    assert clock.wall_of(now) == pytest.approx(wall, abs=1e-3)


@pytest.mark.parametrize("warp", [0.0, -1.0, 400.1, float("nan"), float("inf")])
def test_a_warp_outside_its_range_is_refused(warp):
    with pytest.raises(ValueError, match="warp"):
        check_warp(warp)
