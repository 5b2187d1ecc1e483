"""What ``linkwind validate`` makes of its rows; CI runs the short form of the cases themselves."""

import json

from linkwind.runs.validate import page
from linkwind.runs.validate.rows import Row, most


def test_rows_judge_and_are_plain(tmp_path):
    rows = [
        Row("a", "b [m]", 1.02, 1.0, 0.03, "x"),
        Row("a", "c", 1.04, 1.0, 0.03, "x"),
        most("a", "d", 0.1, 0.2),
    ]
    assert [row.ok for row in rows] == [True, False, True]
    assert Row("a", "b", 2.0, 1.0, None, "x").ok is None
    assert json.loads(json.dumps(rows[0].as_json())).keys() >= {
        "case", "quantity", "value", "reference", "ratio", "ok"
    }  # fmt: skip
    page.write(tmp_path / "flow.html", "title", rows, [])
    text = (tmp_path / "flow.html").read_text(encoding="utf-8")
    assert "1.02" in text
    assert "off" in text
