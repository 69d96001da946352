"""The inputs of the three options, number by number."""

import pytest

from missions.bloom.inputs import Battery, InputSettings, exploit_input, explore_input, migrate_input

MISSION = InputSettings(
    currently_sampling_weight=40.0,
    finish_migration_input=100.0,
    migration_pause=600.0,
    migration_resistance=-200.0,
    no_samples_patience=1200.0,
    no_samples_slope=0.0,
)


@pytest.mark.parametrize(
    ("distance", "raw"), [(0.0, 0.0), (75.0, 25.0), (150.0, 50.0), (400.0, 50.0), (None, 0.0)]
)
def test_a_sample_point_draws_the_more_the_farther_it_is_up_to_a_limit(distance, raw):
    assert exploit_input(MISSION, distance, False) == raw
    assert exploit_input(MISSION, distance, True) == raw + 40.0


def test_exploring_is_wanted_without_sample_points_and_with_an_empty_battery():
    assert explore_input(MISSION, 0.0, False, False) == 50.0
    assert explore_input(MISSION, 0.2, True, False) == 10.0
    assert explore_input(MISSION, 0.2, False, True) == 10.0


def test_a_storm_calls_for_migration_whatever_was_before():
    assert migrate_input(MISSION, True, False, 10.0, 0.0) == 100.0
    assert migrate_input(MISSION, True, True, 10.0, 0.0) == 200.0


def test_a_recent_migration_speaks_against_another_and_less_so_with_time():
    assert migrate_input(MISSION, False, False, 1.0, 0.0) == 0.0
    assert migrate_input(MISSION, False, False, 300.0, 0.0) == -100.0
    assert migrate_input(MISSION, False, False, 599.0, 0.0) == pytest.approx(-1 / 3)
    assert migrate_input(MISSION, False, False, 600.0, 0.0) == 0.0
    assert migrate_input(MISSION, False, True, 300.0, 0.0) == 0.0


def test_long_without_sample_points_the_other_zone_begins_to_call():
    settings = InputSettings(no_samples_patience=60.0, no_samples_slope=0.1)
    assert migrate_input(settings, False, False, 1000.0, 60.0) == 0.0
    assert migrate_input(settings, False, False, 1000.0, 160.0) == pytest.approx(10.0)


def test_the_battery_follows_the_way_made_with_a_lag():
    battery = Battery(InputSettings(battery_lag=10.0))
    assert battery.update(720.0, 0.0) == pytest.approx(0.1)
    assert battery.update(1440.0, 10.0) == pytest.approx(0.1 + 0.1 * (1.0 - 0.36787944))
    assert battery.update(1440.0, 1000.0) == pytest.approx(0.2)


def test_a_measured_voltage_outranks_the_way_made_and_is_held_to_the_limits():
    battery = Battery(InputSettings(battery_lag=0.0))
    battery.volts = 13.5
    assert battery.update(0.0, 0.0) == pytest.approx(0.5)
    battery.volts = 99.0
    assert battery.update(7000.0, 1.0) == 0.0
    battery.volts = 0.0
    assert battery.update(0.0, 2.0) == 1.0
