"""pDeadManPost, uLoadWatch, pAutoPoke, pMissionHash."""

import random
import re

import pytest
from app_harness import Harness

from pymoos_lite.apps.auto_poke import AutoPoke
from pymoos_lite.apps.load_watch import LoadWatch, Threshold, parse_threshold
from pymoos_lite.apps.mission_hash import MissionHashApp
from pymoos_lite.field.dead_man import DeadMan as DeadManPost
from pymoos_lite.records.csp import RecordError
from pymoos_lite.records.mission_hash import ADJECTIVES, NOUNS, MissionHash, make_hash

DEAD = "heartbeat_var = ALIVE\nmax_noheart = 5\ndeadflag = RETURN = true\ndeadflag = N = 5\n"


def beat(app: Harness, seconds: int) -> Harness:
    for i in range(seconds):
        app.post("ALIVE", float(i)).run(1)
    return app


def test_silence_from_the_start_posts_the_flags_once():
    app = Harness(DeadManPost, DEAD).run(4)
    assert app.values("RETURN") == []
    app.run(20)
    assert (app.values("RETURN"), app.values("N")) == (["true"], [5.0])


def test_beats_keep_the_flags_back():
    app = beat(Harness(DeadManPost, DEAD), 12)
    assert app.values("RETURN") == []
    assert app.run(4).values("RETURN") == []
    assert app.run(3).values("RETURN") == ["true"]


def test_without_active_at_start_the_first_beat_starts_the_count():
    app = Harness(DeadManPost, DEAD + "active_at_start = false").run(30)
    assert app.values("RETURN") == []
    assert beat(app, 1).run(10).values("RETURN") == ["true"]


@pytest.mark.parametrize(("policy", "posts"), [("once", 1), ("reset", 2)])
def test_once_is_once_and_reset_is_once_for_each_silence(policy, posts):
    app = Harness(DeadManPost, DEAD + f"post_policy = {policy}").run(10)
    assert len(beat(app, 2).run(10).values("RETURN")) == posts


def test_repeat_posts_in_every_iteration_until_a_beat_comes():
    app = Harness(DeadManPost, DEAD + "post_policy = repeat\nAppTick = 2").run(10)
    assert 9 <= len(app.values("RETURN")) <= 11
    assert len(beat(app, 4).values("RETURN")) <= 11


def test_load_watch_asks_for_gaps_and_forgives_the_first_breach():
    app = Harness(LoadWatch, "thresh = app=pHelmIvP, gapthresh=1.5").run(1)
    assert app.values("LOADCAST_REQ") == ["app=pHelmIvP,thresh=1.5,duration=30"]
    app.post("PHELMIVP_ITER_GAP", 2.0).run(1)
    assert app.values("ULW_BREACH") == ["false"]
    app.post("PHELMIVP_ITER_GAP", 1.8).run(1)
    assert app.values("ULW_BREACH") == ["false", "true"]
    assert app.values("ULW_BREACH_COUNT") == [1.0]
    assert app.values("ULW_BREACH_LIST") == ["PHELMIVP"]
    assert app.values("LOAD_WARNING") == ["app=PHELMIVP, maxgap=2, node=abe"]
    assert len(app.run(15).values("LOADCAST_REQ")) == 2


def test_any_covers_every_app_and_a_named_threshold_goes_first():
    app = Harness(
        LoadWatch, "thresh = app=any, gapthresh=2\nthresh = app=pB, gapthresh=3\nbreach_trigger=0"
    ).run(1)
    assert app.values("LOADCAST_REQ")[0] == "app=any,thresh=2,duration=30"
    app.post("PA_ITER_GAP", 2.5).post("PB_ITER_GAP", 2.5).post("PC_ITER_GAP", 1.95).run(1)
    assert app.values("ULW_BREACH_LIST") == ["PA"]
    assert app.values("ULW_NEAR_BREACH_LIST") == ["PC"]
    app.post("PB_ITER_GAP", 3.5).run(1)
    assert app.values("ULW_BREACH_LIST")[-1] == "PA,PB"
    assert app.values("ULW_BREACH_COUNT")[-1] == 2.0


def test_the_requested_app_answers_a_request_of_the_watch():
    watch = Harness(LoadWatch, "thresh = app=any, gapthresh=1.5").run(1)
    answering = Harness(AutoPoke, "", name="pAutoPoke").run(1)
    answering.post("LOADCAST_REQ", str(watch.values("LOADCAST_REQ")[0])).run(2)
    assert answering.values("PAUTOPOKE_ITER_GAP")


def test_thresholds():
    assert parse_threshold("app=All, gapthresh=1.5") == Threshold("ANY", 1.5)
    for text in ("app=x", "gapthresh=2", "app=x,gapthresh=1", "app=x,gapthresh=y", "nonsense"):
        with pytest.raises(ValueError, match="expected"):
            parse_threshold(text)


def test_auto_poke_posts_in_file_order_once_enough_vessels_have_reported():
    app = Harness(AutoPoke, "flag = DEPLOY_ALL=true\nflag = SPEED=2\nrequired_nodes = 2").run(3)
    app.post("UFSB_NODE_COUNT", 1).run(3)
    assert app.values("DEPLOY_ALL") == []
    app.post("UFSB_NODE_COUNT", 2).run(3).post("UFSB_NODE_COUNT", 3).run(3)
    flags = [(name, value) for _, name, value in app.said if name in ("DEPLOY_ALL", "SPEED")]
    assert flags == [("DEPLOY_ALL", "true"), ("SPEED", 2.0)]


def test_a_mission_gets_one_hash_until_it_is_reset():
    app = Harness(MissionHashApp, None).run(65)
    full = app.values("MISSION_HASH")
    assert len(full) == 3
    assert len(set(full)) == 1
    assert re.fullmatch(r"mhash=260101-0000[A-Z]-[A-Z]{4}-[A-Z]{4},utc=1767225600\.00", str(full[0]))
    assert set(app.values("MHASH")) == {MissionHash.parse(str(full[0])).short}
    app.post("RESET_MHASH", "true").run(1)
    assert app.values("MISSION_HASH")[-1] != full[0]


def test_either_variable_can_be_switched_off():
    app = Harness(MissionHashApp, "mission_hash_var = off\nmhash_short_var = NAME").run(1)
    assert app.values("MISSION_HASH") == app.values("off") == []
    assert len(app.values("NAME")) == 1


def test_hashes_read_back_and_nonsense_is_refused():
    made = make_hash(1730622896.5, random.Random(1), utc=True)
    assert made.full.startswith("241103-0834")
    assert MissionHash.parse(made.to_text()) == made
    for text in ("", "utc=5", "mhash=A,utc=x"):
        with pytest.raises(RecordError):
            MissionHash.parse(text)


def test_the_words_have_four_letters_and_no_doubles():
    for words in (ADJECTIVES, NOUNS):
        assert {len(w) for w in words} == {4}
        assert len(set(words)) == len(words)
