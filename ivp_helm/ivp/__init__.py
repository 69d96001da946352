"""Interval programming on its own: domains, piecewise functions, builders, an exact solver."""

from ivp_helm.ivp.boxes import Region, parse_point_box, parse_region_box, uniform_piece
from ivp_helm.ivp.build_info import Build, join_build_info, parse_build_info
from ivp_helm.ivp.codec import decode, encode
from ivp_helm.ivp.coupler import CoupledPeak, couple
from ivp_helm.ivp.domain import Domain, DomainEntry, Variable, parse_entry
from ivp_helm.ivp.errors import IvPError
from ivp_helm.ivp.function import IvPFunction, constant
from ivp_helm.ivp.packets import Joiner, join_packets, split_packets
from ivp_helm.ivp.reflector import Rating, rate, reflect, tabulate
from ivp_helm.ivp.solver import Solution, Status, decision_domain, solve, solve_exhaustive
from ivp_helm.ivp.tabled import Tiling, from_table
from ivp_helm.ivp.warm import warm_up
from ivp_helm.ivp.zaic import Peak, zaic_hdg, zaic_heq, zaic_leq, zaic_peak, zaic_spd, zaic_vector

__all__ = [
    "Build",
    "CoupledPeak",
    "Domain",
    "DomainEntry",
    "IvPError",
    "IvPFunction",
    "Joiner",
    "Peak",
    "Rating",
    "Region",
    "Solution",
    "Status",
    "Tiling",
    "Variable",
    "constant",
    "couple",
    "decision_domain",
    "decode",
    "encode",
    "from_table",
    "join_build_info",
    "join_packets",
    "parse_build_info",
    "parse_entry",
    "parse_point_box",
    "parse_region_box",
    "rate",
    "reflect",
    "solve",
    "solve_exhaustive",
    "split_packets",
    "tabulate",
    "uniform_piece",
    "warm_up",
    "zaic_hdg",
    "zaic_heq",
    "zaic_leq",
    "zaic_peak",
    "zaic_spd",
    "zaic_vector",
]
