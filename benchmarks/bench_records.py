"""How long reading and printing the busiest records takes, per record.

Baseline "naive": a bare split of the same text into a dictionary of strings, and a join of it, without
types, order or rules.
Run as a script; best of several rounds.
"""

from __future__ import annotations

from collections.abc import Callable
from timeit import repeat

from pymoos_lite.geometry.specs import parse_point, parse_seglist, point_text, seglist_text
from pymoos_lite.records import node_report
from pymoos_lite.records.appcast import AppCast
from pymoos_lite.records.node_message import NodeMessage

REPORT = (
    "NAME=abe,X=294.44,Y=-404.56,SPD=1.28,HDG=306.52,DEP=0,LAT=43.82500629,LON=-70.32989629,TYPE=kayak,"
    "COLOR=yellow,MODE=MODE@ACTIVE:RETURNING,ALLSTOP=clear,INDEX=832,YAW=2.5041367,TIME=17953952104,LENGTH=4"
)
MESSAGE = 'src_node=abe,dest_node=ben:cal,src_app=pHelmIvP,var_name=UPDATE,string_val="points=1,2:3,4"'
POINT = "x=60,y=-40,active=true,label=alpha's nextpt,label_color=aqua,vertex_color=yellow,vertex_size=5"
SEGLIST = "pts={60,-40:60,-160:150,-160:180,-100:150,-40},label=alpha_survey,edge_color=white,vertex_size=3"
LINES = tuple(f"line {i} of the report, as long as lines usually are" for i in range(30))
CAST = AppCast("pHelmIvP", 832, "abe", LINES, events=("[1.00]: x",), events_total=1)


def naive_read(text: str) -> dict[str, str]:
    """What reading costs at the very least: split at commas, then at the first equals sign."""
    found = {}
    for piece in text.split(","):
        key, _, value = piece.partition("=")
        found[key] = value
    return found


def naive_print(values: dict[str, str]) -> str:
    return ",".join([f"{k}={v}" for k, v in values.items()])


def microseconds(run: Callable[[], object], number: int = 4000, rounds: int = 7) -> float:
    return min(repeat(run, number=number, repeat=rounds)) / number * 1e6


def main() -> None:
    report = node_report.NodeReport.parse(REPORT)
    message = NodeMessage.parse(MESSAGE)
    point, seglist = parse_point(POINT), parse_seglist(SEGLIST)
    cast = CAST.to_text()
    reads: list[tuple[str, str, Callable[[str], object]]] = [
        ("NODE_REPORT, first reader of a text", REPORT, node_report._parse),
        ("NODE_REPORT, every further reader", REPORT, node_report.NodeReport.parse),
        ("NODE_MESSAGE with a quoted value", MESSAGE, NodeMessage.parse),
        ("VIEW_POINT", POINT, parse_point),
        ("VIEW_SEGLIST, 5 vertices", SEGLIST, parse_seglist),
        ("APPCAST, 30 lines", cast, AppCast.parse),
    ]
    prints: list[tuple[str, str, Callable[[], object]]] = [
        ("NODE_REPORT", REPORT, report.to_text),
        ("NODE_MESSAGE with a quoted value", MESSAGE, message.to_text),
        ("VIEW_POINT", POINT, lambda: point_text(point)),
        ("VIEW_SEGLIST, 5 vertices", SEGLIST, lambda: seglist_text(seglist)),
        ("APPCAST, 30 lines", cast, CAST.to_text),
    ]
    print(f"{'record':<48}{'us':>8}{'naive us':>10}{'ratio':>8}")
    for name, text, read in reads:
        took = microseconds(lambda read=read, text=text: read(text))  # type: ignore[misc]
        base = microseconds(lambda text=text: naive_read(text))  # type: ignore[misc]
        print(f"{'read  ' + name:<48}{took:>8.2f}{base:>10.2f}{took / base:>8.2f}")
    for name, text, write in prints:
        raw = naive_read(text)
        took, base = microseconds(write), microseconds(lambda raw=raw: naive_print(raw))  # type: ignore[misc]
        print(f"{'print ' + name:<48}{took:>8.2f}{base:>10.2f}{took / base:>8.2f}")


if __name__ == "__main__":
    main()
