"""Figures: what is drawn is what was computed."""

from types import SimpleNamespace

import numpy as np
import pytest

from opinion_engine import graphs, plots, studies
from opinion_engine.fleet_log import fleet_history
from opinion_engine.model import OpinionError


def entry(time, name, value):
    return SimpleNamespace(time=time, name=name, value=value)


def test_the_simplex_plane_keeps_distances_and_puts_options_where_they_belong():
    z = np.random.default_rng(0).normal(size=(50, 3))
    z -= z.mean(axis=1, keepdims=True)
    assert np.allclose(np.linalg.norm(plots.on_simplex(z), axis=1), np.linalg.norm(z, axis=1))
    left, right, top = plots.on_simplex([[2, -1, -1], [-1, 2, -1], [-1, -1, 2]])
    assert left[0] < 0 < right[0]
    assert top[1] > max(left[1], right[1])
    assert top[0] == pytest.approx(0.0)


def test_points_outside_the_limits_are_scaled_back_towards_the_origin():
    inside, outside = plots.into_limits([[3.0, -1.0, -2.0], [-50.0, -50.0, 100.0]], -20.0, 40.0)
    assert inside.tolist() == [3.0, -1.0, -2.0]
    assert outside == pytest.approx([-20.0, -20.0, 40.0])


def test_a_simplex_figure_has_one_trace_and_one_dot_per_vessel_and_panel(tmp_path):
    t = np.linspace(0, 6, 200)
    z = np.stack(
        [np.stack([np.sin(t + k), np.cos(t + k), -np.sin(t + k) - np.cos(t + k)], 1) for k in range(3)], 1
    )
    made = plots.simplex_figure(z, ["abe", "ben", "cal"], ["explore", "exploit", "migrate"])
    made.savefig(tmp_path / "s.png")
    assert (tmp_path / "s.png").stat().st_size > 10_000
    for axis, low in zip(made.axes, (-20.0, -4.0), strict=True):
        traces = [line for line in axis.lines if len(line.get_xdata()) == 200]
        assert len(traces) == 3
        expected = plots.on_simplex(plots.into_limits(z[:, 0], low, -2 * low))
        assert np.allclose(np.column_stack(traces[0].get_data()), expected)
    with pytest.raises(OpinionError, match="simplex needs"):
        plots.simplex_figure(z[:, :, :2], ["abe", "ben", "cal"], ["a", "b"])


def test_attention_and_degree_are_drawn_against_minutes():
    t = np.arange(0, 600.0)
    u = np.column_stack([np.full(600, 0.5), np.linspace(0.5, 2.0, 600)])
    made = plots.attention_figure(t, u, np.tile([1.0, 1.0], (600, 1)), ["abe", "ben"])
    top, bottom = made.axes
    assert np.allclose(top.lines[1].get_xydata(), np.column_stack([t / 60, u[:, 1]]))
    assert bottom.lines[0].get_drawstyle() == "steps-post"
    with pytest.raises(OpinionError, match="must be"):
        plots.attention_figure(t, u, u[:5], ["abe", "ben"])


def test_the_cascade_sheet_shows_moments_from_first_to_last(tmp_path):
    graph = graphs.ring(12)
    t = np.arange(30.0)
    x = np.array([[1.0 if k <= step / 2 else 0.0 for k in range(12)] for step in range(30)])
    made = plots.cascade_sheet([("ring", graph, t, x)], columns=4)
    titles = [axis.get_title() for axis in made.axes[:4]]
    assert titles[0].endswith("1 of 12")
    assert titles[-1].endswith("12 of 12")
    assert titles == sorted(titles, key=lambda text: float(text.split()[2]))
    plots.cascade_animation(graph, t, x, str(tmp_path / "c.gif"), frames=5)
    assert (tmp_path / "c.gif").read_bytes().startswith(b"GIF8")


def test_a_network_without_positions_cannot_be_drawn():
    graph = graphs.all_to_all(4)
    with pytest.raises(OpinionError, match="needs positions"):
        plots.cascade_sheet([("all", graph, np.arange(3.0), np.eye(3, 4))], columns=2)


@pytest.mark.slow
def test_simulated_points_lie_on_the_predicted_branches():
    made = studies.pitchfork_study(seed=3, points=8, starts=1)
    for axis in made.axes[:3]:
        dots = next(line for line in axis.lines if line.get_marker() == "o")
        solid = [
            line for line in axis.lines if line.get_linestyle() == "-" and line.get_color() == plots.PREDICTED
        ]
        for u, x in dots.get_xydata():
            gaps = []
            for line in solid:
                along = line.get_xdata()
                if along[0] <= u <= along[-1]:
                    gaps.append(abs(np.interp(u, along, line.get_ydata()) - x))
            assert min(gaps) < 0.02
    assert made.axes[3].texts[0].get_text() == "b* = 0.0226"


def test_basins_follow_the_symmetry_of_the_couplings():
    made = studies.basin_study(resolution=16)
    cooperation, competition = (axis.images[0].get_array() for axis in made.axes[:2])
    assert np.array_equal(cooperation[0, 0], cooperation[5, 5])
    assert not np.array_equal(cooperation[2, 2], cooperation[13, 13])
    assert np.array_equal(cooperation[0, 3], cooperation[0, 0])
    assert np.array_equal(competition[2, 13], competition[0, 15])
    assert not np.array_equal(competition[2, 13], competition[13, 2])


def test_cascades_reach_everybody_on_every_graph():
    for _, graph, _, x in studies.cascade_runs():
        reached = (x > 0.5).sum(axis=1)
        assert reached[0] == 0
        assert reached[-1] == graph.n_agents
        assert np.all(np.diff(reached) >= 0)


def test_a_fleet_s_history_is_read_from_its_logs():
    logs = {
        "abe": [
            entry(1.0, "OWN_OPINION_STATE", "abe:leader:explore=1.0:migrate=-1.0"),
            entry(1.0, "OWN_ATTENTION", "0.5"),
            entry(2.5, "CONTACTS_LIST", "ben,cal"),
            entry(3.0, "OWN_OPINION_STATE", "abe:leader:explore=2.0:"),
            entry(3.0, "OWN_OPINION_STATE", "damaged"),
            entry(4.0, "OWN_ATTENTION", "0.75"),
            entry(4.0, "CONTACTS_LIST", ""),
        ],
        "ben": [entry(2.0, "OWN_OPINION_STATE", "ben:leader:explore=-1.0:migrate=1.0")],
    }
    story = fleet_history(logs)
    assert story.names == ("abe", "ben")
    assert story.options == ("explore", "migrate")
    assert story.t.tolist() == [0, 1, 2, 3]
    assert story.z[:, 0].tolist() == [[0, 0], [1, -1], [1, -1], [2, 0]]
    assert story.z[:, 1, 1].tolist() == [0, 0, 1, 1]
    assert np.array_equal(story.u[:, 0], [np.nan, 0.5, 0.5, 0.5], equal_nan=True)
    assert story.degree[:, 0].tolist() == [0, 0, 0, 2]
    with pytest.raises(OpinionError, match="no OWN_OPINION_STATE in the logs of cal"):
        fleet_history({"cal": []})
