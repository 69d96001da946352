"""The built-in apps and behaviours by name: plain text, so that listing them imports none of them.

A newcomer adds an app or a behaviour of this project here, in one line.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Entry:
    """`name` is the MOOS-IvP name, `target` is ``module:Class``, `aliases` are other accepted names.

    `host` marks apps that the host itself provides (the database), which are never instantiated.
    """

    name: str
    target: str
    aliases: tuple[str, ...] = ()
    doc: str = ""
    host: bool = False


# fmt: off
APPS: tuple[Entry, ...] = (
    Entry("MOOSDB", "", ("database",), "The community database; every host has one built in.", host=True),
    Entry("pLogger", "pymoos_lite.apps.logger:Logger", ("logger",), "Writes .alog, .slog and .xlog files."),
    Entry("uProcessWatch", "pymoos_lite.apps.process_watch:ProcessWatch", ("process_watch",),
          "Says which apps are missing."),
    Entry("uTimerScript", "pymoos_lite.apps.timer_script:TimerScript", ("timer_script",),
          "Posts events by a timetable."),
    Entry("pEchoVar", "pymoos_lite.apps.echo_var:EchoVar", ("echo_var",), "Posts variables again by other names."),
    Entry("uSimMarineV22", "pymoos_lite.marine.simulator:Simulator", ("simulator",), "Simulates a vessel."),
    Entry("uSimMarineV23", "pymoos_lite.marine.simulator:SimulatorV23", (), "Simulates a vessel with a sail or fan."),
    Entry("uSimMarine", "pymoos_lite.marine.simulator:LegacySimulator", (),
          "Simulates a vessel as older missions expect it."),
    Entry("pMarinePIDV22", "pymoos_lite.marine.pid_app:PidController", ("pid",), "Heading, speed and depth control."),
    Entry("pMarinePID", "pymoos_lite.marine.pid_app:LegacyPidController", (), "Control as older missions expect it."),
    Entry("pNodeReporter", "pymoos_lite.marine.node_reporter:NodeReporter", ("node_reporter",),
          "Publishes node reports."),
    Entry("pContactMgrV20", "pymoos_lite.marine.contact_manager:ContactManager", ("contact_manager",),
          "Follows other vessels and alerts behaviours."),
    Entry("pBasicContactMgr", "pymoos_lite.marine.contact_manager:BasicContactManager", (),
          "The older name of the contact manager."),
    Entry("uFldCollisionDetect", "pymoos_lite.marine.collision_detect:CollisionDetect", ("collision_detect",),
          "Referee of encounters between vessels."),
    Entry("pObstacleMgr", "pymoos_lite.marine.obstacle_manager:ObstacleManager", ("obstacle_manager",),
          "Follows obstacles and alerts behaviours."),
    Entry("uFldObstacleSim", "pymoos_lite.marine.obstacle_sim:ObstacleSim", ("obstacle_sim",),
          "Simulates a field of obstacles."),
    Entry("uFldCollObDetect", "pymoos_lite.marine.obstacle_collisions:ObstacleCollisions", (),
          "Referee of vessels and obstacles."),
    Entry("uFldPathCheck", "pymoos_lite.marine.path_check:PathCheck", ("path_check",), "Odometers of all vessels."),
    Entry("pShare", "pymoos_lite.field.share:ShareApp", ("share",), "Bridges variables to other communities."),
    Entry("pHostInfo", "pymoos_lite.field.host_info:HostInfo", ("host_info",),
          "Says where this community can be reached."),
    Entry("uFldNodeBroker", "pymoos_lite.field.node_broker:NodeBroker", ("node_broker",),
          "A vehicle finds its shoreside."),
    Entry("uFldShoreBroker", "pymoos_lite.field.shore_broker:ShoreBroker", ("shore_broker",),
          "The shoreside finds its vehicles."),
    Entry("uFldNodeComms", "pymoos_lite.field.node_comms:NodeComms", ("node_comms",),
          "Passes reports and messages between vehicles, as far as they can hear each other."),
    Entry("uFldMessageHandler", "pymoos_lite.field.message_handler:MessageHandler", ("message_handler",),
          "Posts what other vehicles sent in messages."),
    Entry("pDeadManPost", "pymoos_lite.field.dead_man:DeadMan", ("dead_man",),
          "Posts flags when a heartbeat stays away."),
    Entry("uLoadWatch", "pymoos_lite.apps.load_watch:LoadWatch", ("load_watch",), "Says which apps fall behind."),
    Entry("pRealm", "pymoos_lite.apps.realm:Realm", ("realm",), "Tables of the community's variables on request."),
    Entry("pMissionEval", "pymoos_lite.apps.mission_eval:MissionEval", ("mission_eval",),
          "Judges whether a mission passed."),
    Entry("pMissionHash", "pymoos_lite.apps.mission_hash:MissionHashApp", ("mission_hash",), "Names a run."),
    Entry("pAutoPoke", "pymoos_lite.apps.auto_poke:AutoPoke", ("auto_poke",),
          "Posts flags once enough vehicles have reported."),
    Entry("pProxonoi", "pymoos_lite.marine.proxonoi:Proxonoi", ("pProxonoi2", "proxonoi"),
          "Cuts the own cell out of a region shared with others."),
    Entry("pHelmIvP", "ivp_helm.app:Helm", ("helm",), "Decides heading and speed by interval programming."),
    Entry("pOpinionManager", "opinion_engine.app:OpinionManager", ("opinion_manager",),
          "Integrates this vehicle's opinions."),
    Entry("uOptionMarker", "opinion_engine.marker:OptionMarker", ("option_marker",),
          "Draws a circle in the colour of the option each vessel favours."),
)
# fmt: on

VIEWERS = ("pMarineViewer", "uMAC", "uMACView", "uXMS", "uFldScope")
"""Programs of a person's screen: `pymoos` has its own, so a mission that starts them is not faulty."""

# fmt: off
BEHAVIORS: tuple[Entry, ...] = (
    Entry("BHV_Waypoint", "behaviors.waypoint:Waypoint", (), "Traverses a list of points."),
    Entry("BHV_Loiter", "behaviors.loiter:Loiter", (), "Goes around a convex polygon."),
    Entry("BHV_StationKeep", "behaviors.station_keep:StationKeep", (), "Stays near a point."),
    Entry("BHV_ConstantSpeed", "behaviors.constant_speed:ConstantSpeed", (), "Keeps a speed."),
    Entry("BHV_ConstantHeading", "behaviors.constant_heading:ConstantHeading", (), "Keeps a heading."),
    Entry("BHV_ConstantDepth", "behaviors.constant_depth:ConstantDepth", (), "Keeps a depth."),
    Entry("BHV_Timer", "behaviors.timer:Timer", (), "Counts seconds while its conditions hold."),
    Entry("BHV_OpRegionV24", "behaviors.op_region_v24:OpRegionV24", (), "Steers back into a region, stops outside."),
    Entry("BHV_AvoidCollision", "behaviors.avoid_collision:AvoidCollision", (), "Keeps away from another vessel."),
    Entry("BHV_AvoidObstacleV24", "behaviors.avoid_obstacle:AvoidObstacle",
          ("BHV_AvoidObstacleV21", "BHV_AvoidObstacle", "BHV_AvoidObstacleX"),
          "Keeps clear of an obstacle."),
    Entry("BHV_AvdColregsV22", "behaviors.avoid_colregs:AvoidColregs", (), "Keeps away by the rules of the road."),
    Entry("BHV_AvdColregsV26", "behaviors.avoid_colregs:AvoidColregsV26", (),
          "Keeps away by the rules of the road, turning as the vessel turns."),
    Entry("BHV_AvdColregsV19", "behaviors.avoid_colregs:AvoidColregsV19", (),
          "An older version of the rules of the road."),
    Entry("BHV_AvdColregsV17", "behaviors.avoid_colregs:AvoidColregsV17", (),
          "A still older version of the rules of the road."),
    Entry("BHV_CutRange", "behaviors.cut_range:CutRange", (), "Pursues another vessel."),
    Entry("BHV_Trail", "behaviors.trail:Trail", (), "Keeps a place relative to another vessel."),
    Entry("BHV_Shadow", "behaviors.shadow:Shadow", (), "Takes the course and speed of another vessel."),
    Entry("BHV_Convoy", "behaviors.convoy:Convoy", (), "Follows in another vessel's wake."),
    Entry("BHV_OpRegionRecover", "behaviors.op_region_recover:OpRegionRecover", (), "Steers back into a region."),
    Entry("BHV_MoveToRegion", "behaviors.move_to_region:MoveToRegion", (), "Goes into a region."),
    Entry("BHV_Voronoi", "behaviors.voronoi:Voronoi", ("BHV_Voronoi2",), "Goes to the middle of the own cell."),
    Entry("BHV_SearchControl", "behaviors.region_search:SearchControl", ("BHV_RegionSearchControl",),
          "Keeps moving inside a region."),
    Entry("BHV_GoToDepth", "behaviors.go_to_depth:GoToDepth", (), "Goes to one depth after the other."),
    Entry("BHV_MaxSpeed", "behaviors.max_speed:MaxSpeed", (), "Limits the speed."),
    Entry("BHV_MaxDepth", "behaviors.max_depth:MaxDepth", (), "Limits the depth."),
    Entry("BHV_MinAltitudeX", "behaviors.min_altitude:MinAltitudeX", (), "Keeps off the bottom."),
    Entry("BHV_TimeOut", "behaviors.time_out:TimeOut", (), "Stops the vehicle after some time."),
    Entry("BHV_OpRegion", "behaviors.op_region:OpRegion", (), "Stops the vehicle outside its limits."),
    Entry("BHV_MemoryTurnLimit", "behaviors.memory_turn_limit:MemoryTurnLimit", (), "Allows no hard turns."),
    Entry("BHV_ZigZag", "behaviors.zig_zag:ZigZag", (), "Swings to and fro about a heading."),
    Entry("BHV_LegRun", "behaviors.leg_run:LegRun", (), "Sails a race track between two points."),
    Entry("BHV_FixedTurn", "behaviors.fixed_turn:FixedTurn", ("BHV_FixTurn",),
          "Turns by an angle and measures the circle."),
    Entry("BHV_FullStop", "behaviors.full_stop:FullStop", (), "Comes to a stop."),
    Entry("BHV_PeriodicSpeed", "behaviors.periodic_speed:PeriodicSpeed", (), "Asks for a speed from time to time."),
    Entry("BHV_PeriodicSurface", "behaviors.periodic_surface:PeriodicSurface", (), "Comes up from time to time."),
    Entry("BHV_RStationKeep", "behaviors.r_station_keep:RStationKeep", (), "Keeps a place beside another vessel."),
    Entry("BHV_MaintainHeading", "behaviors.maintain_heading:MaintainHeading", (), "Keeps the heading it began with."),
    Entry("BHV_HeadingBias", "behaviors.heading_bias:HeadingBias", (), "Prefers one side of the heading."),
    Entry("BHV_HeadingChange", "behaviors.heading_change:HeadingChange", (), "Turns by an angle."),
    Entry("BHV_Hysteresis", "behaviors.hysteresis:Hysteresis", (), "Holds on to the heading."),
    Entry("BHV_HeadingHysteresis", "behaviors.hysteresis:HeadingHysteresis", (),
          "Tells how steady the course asked for is."),
    Entry("BHV_AbortToPoint", "behaviors.abort_to_point:AbortToPoint", (), "Makes for a point."),
    Entry("BHV_TestFailure", "behaviors.deliberate_failure:TestFailure", (), "Fails on purpose, to test watchdogs."),
    Entry("BHV_HSLine", "behaviors.hs_line:HSLine", (), "Draws the heading asked for."),
    Entry("BHV_BearingLine", "behaviors.bearing_line:BearingLine", (), "Draws a line towards a point."),
    Entry("BHV_PModelView", "behaviors.p_model_view:PModelView", (), "Draws how the vessel will turn."),
    Entry("BHV_RangePulse", "behaviors.range_pulse:RangePulse", (), "Shows range reports."),
)
# fmt: on
