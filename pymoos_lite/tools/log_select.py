"""`pymoos log grep|rm|clip|sort`: part of a log as a log again, or as columns (community.md 13).

Everything streams, except sorting. Output goes to the terminal unless a second log file is named.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import TextIO

from pymoos_lite.records.alog import AlogEntry, AlogLine, read_lines
from pymoos_lite.records.csp import fields
from pymoos_lite.tools.log_reading import LogError, Selection, find_log, read_log, split_words

FORMATS = ("val", "time:val", "time:var:val", "time:var:src")
_NOISE = ("_GAP", "_LEN")

Keep = Callable[[AlogLine], bool]


def add_grep(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "words", nargs="+", metavar="IN.alog VAR.. APP.. [OUT.alog]", help="what to keep; VAR* is a beginning"
    )
    _add_common(parser)
    parser.add_argument("-gl", action="store_true", help="also keep variables ending in _GAP and _LEN")
    parser.add_argument("-kb", action="store_true", help="keep malformed lines")
    parser.add_argument("-s", dest="sort", action="store_true", help="sort by time")
    parser.add_argument("-d", dest="unique", action="store_true", help="drop repeated lines")
    parser.add_argument("-sd", dest="both", action="store_true", help="sort and drop repeated lines")
    parser.add_argument("--format", choices=FORMATS, help="print columns instead of log lines")
    parser.add_argument("--v", action="store_const", dest="format", const="val", help="--format=val")
    parser.add_argument(
        "--tv", action="store_const", dest="format", const="time:val", help="--format=time:val"
    )
    parser.add_argument(
        "--tvv", action="store_const", dest="format", const="time:var:val", help="--format=time:var:val"
    )
    parser.add_argument("--first", action="store_true", help="only the first entry")
    parser.add_argument("--final", action="store_true", help="only the last entry")
    for option, separator, word in (
        ("--csw", " ", "blanks"),
        ("--csc", ",", "commas"),
        ("--cso", ":", "colons"),
        ("--css", ";", "semicolons"),
    ):
        parser.add_argument(
            option, action="store_const", dest="separator", const=separator, help=f"{word} as separators"
        )
    parser.add_argument("--subpat", metavar="A:B", help="of k=v,k=v values print these fields")
    parser.add_argument("--kk", action="store_true", help="with --subpat: keep the k=")


def add_rm(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "words", nargs="+", metavar="IN.alog VAR.. APP.. [OUT.alog]", help="what to leave out"
    )
    _add_common(parser)
    parser.add_argument("--nostr", action="store_true", help="leave out texts")
    parser.add_argument("--nonum", action="store_true", help="leave out numbers")
    parser.add_argument("--clean", action="store_true", help="leave out lines that are no entries")


def add_clip(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "words", nargs="+", metavar="IN.alog MIN MAX [OUT.alog]", help="keep MIN <= time <= MAX"
    )
    _add_common(parser)
    parser.add_argument("-b", "--batch", action="store_true", help="name the output after the input")
    parser.add_argument("--suffix", default="_clipped", help="what --batch puts behind the name")


def add_sort(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "words", nargs="+", metavar="IN.alog [OUT.alog]", help="sort by time; equal times keep order"
    )
    _add_common(parser)
    parser.add_argument(
        "-c", "--check", action="store_true", help="only say whether it is sorted (status 1 if not)"
    )


def _add_common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-f", "--force", action="store_true", help="overwrite OUT")
    parser.add_argument("-nc", dest="no_header", action="store_true", help="drop the header")
    parser.add_argument("-q", "--quiet", action="store_true", help="say nothing")
    parser.add_argument("-nr", dest="no_report", action="store_true", help="no closing report")


def run_grep(args: argparse.Namespace) -> int:
    source, target, patterns = _files(args.words)
    chosen = Selection.of(patterns)

    def keep(line: AlogLine) -> bool:
        entry = line.entry
        if entry is None:
            return bool(args.kb)
        if entry.name.endswith(_NOISE) and not args.gl and entry.name not in chosen.exact:
            return False
        return not patterns or chosen.picks(entry)

    return _select(args, source, target, keep)


def run_rm(args: argparse.Namespace) -> int:
    source, target, patterns = _files(args.words)
    chosen = Selection.of(patterns)
    if not (patterns or args.nostr or args.nonum or args.clean):
        raise LogError("nothing to leave out: name variables or apps, or give --nostr, --nonum or --clean")

    def keep(line: AlogLine) -> bool:
        entry = line.entry
        if entry is None:
            return not args.clean
        if args.clean and not entry.value:
            return False
        if (args.nonum and entry.number is not None) or (args.nostr and entry.number is None):
            return False
        return not chosen.picks(entry)

    return _select(args, source, target, keep)


def run_clip(args: argparse.Namespace) -> int:
    source, target, limits = _files(args.words)
    try:
        low, high = sorted(float(limit) for limit in limits)
    except ValueError:
        raise LogError("expected IN.alog MIN MAX [OUT.alog] with two times in seconds") from None
    if args.batch and target is None:
        path = find_log(source)
        target = str(
            path.with_name(path.name.removesuffix(".gz").removesuffix(".alog") + args.suffix + ".alog")
        )
    inside = False

    def keep(line: AlogLine) -> bool:
        nonlocal inside
        if line.entry is not None:
            inside = low <= line.entry.time <= high
        return inside  # a line that continues a value goes with its entry

    return _select(args, source, target, keep)


def run_sort(args: argparse.Namespace) -> int:
    source, target, extra = _files(args.words)
    if extra:
        raise LogError(f"unexpected '{extra[0]}': expected IN.alog [OUT.alog]")
    if args.check:
        late = count_late(line.entry for line in read_lines(read_log(source)))
        if not args.quiet:
            print(f"{source}: {'sorted' if not late else f'{late} entries are earlier than the one before'}")
        return 1 if late else 0
    return _select(args, source, target, lambda line: True)


def count_late(entries: Iterable[AlogEntry | None]) -> int:
    """How many entries have an earlier time than the one before."""
    late, last = 0, float("-inf")
    for entry in entries:
        if entry is not None:
            late += entry.time < last
            last = entry.time
    return late


def _files(words: list[str]) -> tuple[str, str | None, list[str]]:
    """Input, output and the other words. Raises LogError."""
    logs, others = split_words(words)
    if not logs or len(logs) > 2:
        raise LogError(f"expected one input and at most one output ending in .alog, found {len(logs)}")
    return logs[0], logs[1] if len(logs) > 1 else None, others


def _select(args: argparse.Namespace, source: str, target: str | None, keep: Keep) -> int:
    find_log(source)  # complain before the output is touched
    if target is not None and not args.force and Path(target).exists():
        raise LogError(f"{target}: exists already; --force overwrites it")
    if target is not None and Path(target).resolve() == find_log(source).resolve():
        raise LogError(f"{target}: input and output are the same file")
    both = getattr(args, "both", False)
    sort = both or getattr(args, "sort", False) or (args.command == "sort")
    unique = both or getattr(args, "unique", False)
    counts = [0, 0]

    def chosen() -> Iterator[AlogLine]:
        for line in read_lines(read_log(source)):
            if line.is_comment:
                if not args.no_header:
                    yield line
                continue
            counts[0] += 1
            if keep(line):
                counts[1] += 1
                yield line

    lines: Iterable[AlogLine] = chosen()
    if unique:
        lines = without_repeats(lines)
    if sort:
        lines = sorted_lines(lines)
    if getattr(args, "first", False) or getattr(args, "final", False):
        lines = _ends(lines, first=args.first, final=args.final)
    form = getattr(args, "format", None)
    with _output(target) as out:
        if form is None and not getattr(args, "subpat", None):
            for line in lines:
                out.write(line.text + "\n")
        else:
            for row in columns(lines, form or "val", args.separator or " ", args.subpat, args.kk):
                out.write(row + "\n")
    if target is not None and not (args.quiet or args.no_report):
        print(f"{target}: {counts[1]} of {counts[0]} entries kept")
    return 0


def _output(target: str | None) -> nullcontext[TextIO] | TextIO:
    if target is None:
        return nullcontext(sys.stdout)
    try:
        return Path(target).open("w", encoding="utf-8", newline="\n")
    except OSError as refusal:
        raise LogError(f"{target}: cannot be written ({refusal.strerror})") from None


def without_repeats(lines: Iterable[AlogLine]) -> Iterator[AlogLine]:
    """Each line once, in order of first appearance; comments always."""
    seen: set[str] = set()
    for line in lines:
        if line.is_comment or line.text not in seen:
            seen.add(line.text)
            yield line


def sorted_lines(lines: Iterable[AlogLine]) -> list[AlogLine]:
    """Stable by time; comments first, a line without time stays behind the entry before it."""
    head: list[AlogLine] = []
    keyed: list[tuple[float, AlogLine]] = []
    last = float("-inf")
    for line in lines:
        if line.is_comment:
            head.append(line)
            continue
        last = last if line.entry is None else line.entry.time
        keyed.append((last, line))
    keyed.sort(key=lambda pair: pair[0])
    return head + [line for _, line in keyed]


def _ends(lines: Iterable[AlogLine], *, first: bool, final: bool) -> Iterator[AlogLine]:
    """Comments, and of the entries the first, the last, or both."""
    found: list[AlogLine] = []
    for line in lines:
        if line.entry is None:
            yield line
        elif not found:
            found = [line, line]
            if first:
                yield line
                if not final:
                    return
        else:
            found[1] = line
    if final and found and not (first and found[0] is found[1]):
        yield found[1]


def columns(
    lines: Iterable[AlogLine], form: str, separator: str, picks: str | None, keep_keys: bool
) -> Iterator[str]:
    """Rows of the columns that `form` names (`time:var:val`); `picks` (`a:b`) takes fields out of values."""
    wanted = [key.strip() for key in picks.split(":")] if picks else []
    for line in lines:
        entry = line.entry
        if entry is None:
            continue
        value = entry.value
        if wanted:
            found = dict(fields(value))
            values = [(f"{key}={found[key]}" if keep_keys else found[key]) for key in wanted if key in found]
            if not values:
                continue
            value = separator.join(values)
        parts = {"time": f"{entry.time:.5f}", "var": entry.name, "val": value, "src": entry.source}
        yield separator.join(parts[name] for name in form.split(":"))
