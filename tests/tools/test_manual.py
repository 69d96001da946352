"""Help and the generated reference: every registered app and behaviour, from its declarations."""

import pytest

from pymoos_lite.config import registry
from pymoos_lite.config.parameters import Declaration
from pymoos_lite.tools.cli import main
from pymoos_lite.tools.manual import declarations, write_reference

ENTRIES = [(e, "app") for e in registry.apps() if not e.host] + [
    (e, "behavior") for e in registry.behaviors()
]


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reference")
    assert write_reference(folder) == len({e.name for e, _ in ENTRIES})
    return folder


@pytest.mark.parametrize(("entry", "noun"), ENTRIES, ids=[e.name for e, _ in ENTRIES])
def test_every_app_and_behaviour_has_a_page_that_names_all_its_parameters(entry, noun, reference, capsys):
    cls = registry.load_target(entry.target)
    assert (cls.__doc__ or "").strip(), "a class that people name in a mission says what it does"
    assert main(["help", entry.name]) == 0
    shown = capsys.readouterr().out.strip()
    assert shown in (reference / f"{entry.name}.md").read_text()
    own, base = declarations(cls, noun)
    assert isinstance(base, Declaration)
    for parameter in (*own, *base):
        assert f"  {parameter.name}" in shown
        assert parameter.doc, f"{entry.name}: {parameter.name} has no line of documentation"


@pytest.mark.parametrize(("entry", "noun"), ENTRIES, ids=[e.name for e, _ in ENTRIES])
def test_every_name_is_documented_and_unique(entry, noun):
    assert entry.doc.endswith(".")
    names = [n.lower() for e, k in ENTRIES if k == noun for n in (e.name, *e.aliases)]
    for name in (entry.name, *entry.aliases):
        assert names.count(name.lower()) == 1


def test_an_unknown_name_gets_the_nearest(capsys):
    assert main(["help", "BHV_Loitre"]) == 1
    assert "did you mean 'BHV_Loiter'?" in capsys.readouterr().err
