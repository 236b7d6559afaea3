"""Tables: units in headers, runs within files, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from defras_bt.diagnosis.tables import read_tables
from defras_sim.yaml_source import InvalidFile


def table(folder: Path, text: str) -> Path:
    file = folder / "table.csv"
    file.write_text(text, encoding="utf-8")
    return file


def test_usual_units_become_si(tmp_path):
    text = "time_ms,q5_measured_deg,q3_measured_mm,force_mN,area_mm2,stretch\n500,180,20,3,18,1.5\n"
    (read,) = read_tables(table(tmp_path, text))
    assert {name: float(column[0]) for name, column in read.columns.items()} == pytest.approx(
        {
            "time_s": 0.5,
            "q5_measured_rad": np.pi,
            "q3_measured_m": 0.02,
            "force_N": 0.003,
            "area_m2": 1.8e-5,
            "stretch": 1.5,
        }
    )


def test_comments_and_empty_cells_are_no_readings_and_lines_are_counted(tmp_path):
    text = "# from the bench\ntime_s,force_N\n0,1\n\n0.1,\n# here we slipped\n0.2,nan\n0.3,2\n"
    (read,) = read_tables(table(tmp_path, text))
    assert read["force_N"] == pytest.approx([1, np.nan, np.nan, 2], nan_ok=True)
    assert read.line.tolist() == [3, 5, 7, 8]


def test_one_file_holds_several_runs(tmp_path):
    runs = read_tables(table(tmp_path, "trajectory,time_s\nb,0\na,5\nb,1\n"))
    assert [run.name for run in runs] == ["table:b", "table:a"]
    assert [run["time_s"].tolist() for run in runs] == [[0, 1], [5]]


def test_everything_wrong_is_said_at_once_with_its_place(tmp_path):
    text = "time_s,force,force_N,force_mN\n0,1,2,3\n0.1,x,2,3\n0.2,1\n"
    file = table(tmp_path, text)
    with pytest.raises(InvalidFile) as error:
        read_tables(file)
    said = [str(fault) for fault in error.value.faults]
    assert len(said) == 4
    assert said[0].startswith(f"{file}:1:2: header 'force' should end with a unit")
    assert said[1] == f"{file}:1:4: there are two columns 'force_N'"
    assert said[2] == f"{file}:3:2: force should be a number, is 'x'"
    assert said[3] == f"{file}:4:1: has 2 cells where the header has 4"


@pytest.mark.parametrize("text", ["", "time_s\n", "# nothing but this\n"])
def test_a_table_without_numbers_is_refused(tmp_path, text):
    with pytest.raises(InvalidFile, match="headers and lines of numbers"):
        read_tables(table(tmp_path, text))


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InvalidFile, match="nowhere"):
        read_tables(tmp_path / "nowhere.csv")


def test_a_missing_column_is_guessed(tmp_path):
    (read,) = read_tables(table(tmp_path, "time_s,forces_N\n0,1\n"))
    with pytest.raises(InvalidFile, match=r"needs a column 'force_N'; is it 'forces_N'\?"):
        read["force_N"]
