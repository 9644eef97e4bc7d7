import json
from pathlib import Path

import numpy as np
import pytest
from paper import numbers

import stickslip as ss


def test_table_4_at_one_call():
    record = json.loads(Path(numbers.__file__).with_name("published.json").read_text())
    rows = [row for row in record["status_frequencies"] if row["table"] == "Table 4"]
    table = ss.status_table(ss.models.two_subsystems(friction=2.2), [row["status"] for row in rows])
    for row in rows:
        found = table.data.frequency.sel(combination=row["status"]).to_numpy()
        found = found[~np.isnan(found)]
        # One unit of the last printed digit: some values are truncated.
        assert found == pytest.approx(row["hz"], abs=0.01)


def test_all_combinations_with_unstable_modes_marked():
    scene = ss.models.two_subsystems(friction=2.2)
    table = ss.status_table(scene)
    assert table.data.sizes["combination"] == 16
    for combination in table.data.combination.to_numpy():
        modes = ss.complex_modes(scene, str(combination))
        assert int(table.data.unstable.sel(combination=combination).sum()) == int(modes.unstable.sum())
    lines = repr(table).splitlines()
    assert lines[1].startswith("++")
    assert "124.18*" in lines[1]
    assert "129.24*r" in lines[2]
    assert table._repr_html_().count('<th scope="row">') == 16


def test_frictionless_contacts_do_not_stick():
    table = ss.status_table(ss.models.two_subsystems(friction=(0.0, 1.0)))
    assert not any(str(c)[0] == "s" for c in table.data.combination.to_numpy())


def test_hostile_input():
    scene = ss.models.two_subsystems()
    with pytest.raises(ss.InputError, match="combinations: expected a sequence"):
        ss.status_table(scene, "++")
    with pytest.raises(ss.InputError, match="combination"):
        ss.status_table(scene, ["+++"])
