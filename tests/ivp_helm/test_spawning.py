"""Templates, spawn requests, life and death (helm.md 7.2 to 7.4)."""

from __future__ import annotations

import pytest

from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction, Peak, zaic_peak
from ivp_helm.testing import HelmRig
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message


class Guest(Behavior):
    """Comes when called."""

    BHV_NAME = "BHV_Guest"
    VARIABLES = ("speed",)
    PARAMETERS = Declaration(
        (
            Parameter("speed", "number", 1.0, "m/s", "Speed wanted.", low=0.0),
            Parameter("finish", "boolean", False, "", "Complete in the next run."),
        )
    )

    def on_helm_start(self) -> None:
        self.post("GUESTS_WELCOME", self.config.updates)

    def on_run(self) -> IvPFunction | None:
        if self.config.finish:
            self.complete("left")
        return zaic_peak(self.domain, "speed", Peak(self.config.speed, 0, 1))


class Escort(Guest):
    """Comes for a contact."""

    BHV_NAME = "BHV_Escort"
    PARAMETERS = Guest.PARAMETERS + Declaration(
        (
            Parameter("contact", "text", "", "", "Whom."),
            Parameter("can_disable", "boolean", True, "", "Obey BHV_ABLE_FILTER."),
        )
    )
    CAN_DISABLE = True


TEMPLATE = {
    "name": "guest_",
    "templating": "spawn",
    "updates": "CALL",
    "endflag": "GONE=$[BHVNAME]",
    "spawnflag": "CAME=$[BHVNAME]",
}


def rig(kind=Guest, **more) -> HelmRig:
    helm = HelmRig([(kind, {**TEMPLATE, **more})], domain=("speed:0:5:21",))
    helm.own()
    return helm


def names(helm: HelmRig) -> list[str]:
    return [life.name for life in helm.core.population]


def events(helm: HelmRig) -> list[str]:
    return [str(text) for text in helm.posted("IVPHELM_LIFE_EVENT")]


def test_a_spawn_template_makes_no_instance_but_speaks_at_helm_start():
    helm = rig()
    helm.iterate()
    assert names(helm) == []
    assert helm.posted("GUESTS_WELCOME") == ["CALL"]


def test_a_clone_template_makes_one_instance_and_more_on_request():
    helm = rig(templating="clone")
    helm.iterate()
    assert names(helm) == ["guest_"]
    helm.mail("CALL", "name=two")
    helm.iterate()
    assert names(helm) == ["guest_", "guest_two"]


def test_a_request_spawns_an_instance_with_its_parameters_that_runs_at_once():
    helm = rig()
    helm.iterate()
    helm.mail("CALL", "name=ben # speed=3")
    helm.iterate()
    assert names(helm) == ["guest_ben"]
    assert helm.decision == {"speed": 3.0}
    assert helm.posted("CAME") == ["guest_ben"]
    assert events(helm) == [
        "iter=2,time=0.50,bname=guest_ben,btype=BHV_Guest,event=spawn,seed=name=ben # speed=3"
    ]


def test_the_spawning_text_is_applied_once_and_counts_as_one_update():
    helm = rig()
    helm.mail("CALL", "name=ben # speed=3")
    helm.iterate()
    assert helm.life("guest_ben").counts == "1/1"
    results = helm.posted("IVPHELM_UPDATE_RESULT")
    assert len(results) == 1
    assert "bhv=guest_ben,var=CALL,time=0.25,result=success" in str(results[0])
    helm.iterate(3)
    assert helm.life("guest_ben").counts == "1/1"


def test_an_existing_instance_is_updated_instead_by_short_or_full_name():
    helm = rig()
    helm.mail("CALL", "name=ben # speed=3")
    helm.iterate()
    for text, speed in (("name=ben # speed=4", 4.0), ("name=guest_ben # speed=2", 2.0)):
        helm.mail("CALL", text)
        helm.iterate()
        assert helm.decision == {"speed": speed}
    assert names(helm) == ["guest_ben"]
    assert helm.life("guest_ben").counts == "3/3"


def test_a_full_name_in_the_request_is_taken_as_it_is():
    helm = rig()
    helm.mail("CALL", "name=guest_cal")
    helm.iterate()
    assert names(helm) == ["guest_cal"]


def test_the_name_is_found_behind_values_with_equals_signs():
    helm = rig()
    helm.mail("CALL", "endflag=X=pts={0,0:x=5 # y} # name=ben")
    helm.iterate()
    assert names(helm) == ["guest_ben"]


def test_no_more_than_max_spawnings_are_made():
    helm = rig(max_spawnings=2)
    for name in "abcd":
        helm.mail("CALL", f"name={name}")
        helm.iterate()
    assert names(helm) == ["guest_a", "guest_b"]


def test_a_request_with_a_bad_parameter_aborts_with_a_warning_and_an_event():
    helm = rig()
    helm.mail("CALL", "name=ben # speed=fast")
    helm.iterate()
    assert names(helm) == []
    assert "event=abort,seed=name=ben # speed=fast" in events(helm)[0]
    warnings = [str(text) for text in helm.posted("IVPHELM_BHVSET_WARNING")]
    assert warnings[0].startswith("0:Failed to spawn guest_ben. Bad config: ")
    assert "speed = 'fast' is not a number" in warnings[0]
    assert warnings[1] == "1:Behavior named [ben] or [guest_ben] not found or spawned."


def test_text_without_a_name_spawns_nobody():
    helm = rig()
    helm.mail("CALL", "speed=3")
    helm.mail("CALL", "rename=x")
    helm.iterate()
    assert names(helm) == []


def test_a_dead_one_gives_its_name_free_for_another():
    helm = rig()
    helm.mail("CALL", "name=ben # finish=true")
    helm.iterate()
    assert names(helm) == []
    assert helm.posted("GONE") == ["guest_ben"]
    assert "bname=guest_ben,btype=BHV_Guest,event=death,post_mortem=left" in events(helm)[-1]
    helm.mail("CALL", "name=ben # speed=2")
    helm.iterate()
    assert names(helm) == ["guest_ben"]
    assert "completed_bhvs=guest_ben$" in str(helm.posted("IVPHELM_SUMMARY")[0])


def test_a_request_delivered_again_by_the_database_spawns_nobody_anew():
    helm = rig()
    message = Message("CALL", "name=ben # finish=true", helm.now + 0.25, "contacts")
    helm._mail = [message]
    helm.iterate()
    helm._mail = [message]
    helm.iterate()
    assert helm.posted("CAME") == ["guest_ben"]


def test_the_updates_variable_is_registered_for_once():
    helm = rig()
    for name in "abc":
        helm.mail("CALL", f"name={name}")
        helm.iterate()
    assert helm.posted("IVPHELM_REGISTER").count("CALL") == 1


def test_a_spawned_behaviour_whose_contact_is_unknown_completes_with_its_end_flags():
    helm = rig(Escort)
    helm.mail("CALL", "name=ben # contact=ben")
    helm.iterate()
    assert names(helm) == []
    assert helm.posted("GONE") == ["guest_ben"]


def test_a_spawned_behaviour_lives_as_long_as_its_contact_is_in_the_ledger():
    helm = rig(Escort)
    helm.contacts([{"name": "ben", "x": 5, "y": 5, "heading": 0, "speed": 1}])
    helm.iterate()
    helm.mail("CALL", "name=ben # contact=ben")
    helm.iterate()
    assert names(helm) == ["guest_ben"]
    assert helm.posted("IVPHELM_CONTACT_SUMMARY")[-1:] == []
    helm.iterate()
    assert helm.posted("IVPHELM_CONTACT_SUMMARY")[-1] == "ben"
    helm.contacts([])
    helm.iterate(4 * 89)
    assert names(helm) == ["guest_ben"], "a contact that is referred to is kept twice as long"
    helm.iterate(8)
    assert names(helm) == []


def test_a_contact_disabled_before_comes_disabled():
    helm = rig(Escort)
    helm.contacts([{"name": "Ben", "x": 5, "y": 5, "heading": 0, "speed": 1}])
    helm.mail("BHV_ABLE_FILTER", "action=disable,contact=ben")
    helm.iterate()
    helm.mail("CALL", "name=b # contact=Ben")
    helm.iterate()
    assert helm.outcome("guest_b").state == "disabled"
    helm.mail("BHV_ABLE_FILTER", "action=able,contact=ben")
    helm.iterate()
    assert helm.outcome("guest_b").state == "active"


def test_new_behaviours_run_after_those_of_the_file_in_order_of_spawning():
    helm = HelmRig(
        [(Guest, TEMPLATE), (Guest, {"name": "host"})],
        domain=("speed:0:5:21",),
    )
    helm.own()
    helm.mail("CALL", "name=b")
    helm.mail("CALL", "name=a")
    helm.iterate()
    assert names(helm) == ["host", "guest_b", "guest_a"]
    assert helm.posted("IVPHELM_UPDATEVARS") == ["guest_b=CALL,guest_a=CALL"]


@pytest.mark.parametrize("missing", [{"updates": ""}, {"updates": "two words"}])
def test_a_template_without_a_usable_updates_variable_is_a_problem(missing):
    helm = HelmRig([(Guest, {**TEMPLATE, **missing})], domain=("speed:0:5:21",), faulty=True)
    assert any("templating needs 'updates = VARIABLE'" in str(p) for p in helm.core.problems)
