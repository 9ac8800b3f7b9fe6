"""What benchmarks keep in files and pages: tables of stability, and runs that go on."""

import numpy as np


def stability_row(deviation):
    from benchmarks.stability import measure
    from verification.stability_cases import Case

    return measure(Case("axis", "tried", "holds", 1.0, lambda: deviation))


def test_stability_table_says_where_a_limit_is_not_met():
    from benchmarks.stability import page

    text = page([stability_row(7.0)], "")
    assert "| 7 **not met** |" in text and "0 of 1 rows hold" in text


def test_a_deviation_that_is_no_number_is_not_met():
    row = stability_row(np.nan)
    assert not row.held and "not met" in row.verdict


def test_every_axis_is_in_the_page_of_stability():
    from benchmarks.stability import ALL, PAGE

    page = PAGE.read_text(encoding="utf-8")
    for case in ALL:
        assert f"| {case.axis} | {case.tried} |" in page


def test_bias_goes_on_where_it_stopped(tmp_path, capsys):
    """A scene, few paths: not begun after its time, done once, read again the second time; the page tells it."""
    from benchmarks.bias_study import main, page, read

    out = tmp_path / "bias.jsonl"
    arguments = f"--families tiny_lamps --scenes 1 --seeds 1 --points 2 --errors 0.2 --out {out}"
    arguments = [*arguments.split(), "--paths", "2000", "--no-page"]
    main([*arguments, "--seconds", "-1"])
    assert not out.exists()
    main(arguments)
    assert capsys.readouterr().out.startswith("tiny_lamps")
    main(arguments)
    assert capsys.readouterr().out == ""
    out.write_text(2 * out.read_text(encoding="utf-8"), encoding="utf-8")
    (record,) = read(out)  # what was done twice counts once
    assert (record["family"], record["scene"], record["asked"]) == ("tiny_lamps", 0, 0.2)
    assert "| tiny lamps | 20 % | 1 |" in page([record])
    assert f"| {record['commit']} | 20 % | 1 | {100 * record['told']:.2f} |" in page([record])
