"""Tables over time: what is written is read, by OpenSim too, and what is wrong in a file is named with its line."""

from pathlib import Path

import numpy as np
import pytest

import mjwrap as mw

ROWS = "time\ta\tb\n0\t1\t2\n0.5\t3\t4\n"
V1 = f"Coordinates\nversion=1\nnRows=2\nnColumns=3\ninDegrees=yes\nendheader\n{ROWS}"
V3 = f"inDegrees=no\nDataType=double\nversion=3\nOpenSimVersion=4.5\nendheader\n{ROWS}"
SIMM = "name motion.mot\ndatacolumns 3\ndatarows 2\nrange 0 0.5\nendheader\n time   a b\n 0 1 2\n 0.5   3 4\n"


def made_up(seed: int = 0) -> mw.Table:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(40, 3)) * 10.0 ** rng.integers(-12, 12, (40, 3))
    return mw.Table(
        np.cumsum(rng.uniform(1e-3, 1.0, 40)), ("length:BIC", "a b", "q,r[0]"), values, {"subject": "3"}
    )


@pytest.mark.parametrize("suffix", [".sto", ".mot", ".csv", ".npz"])
def test_a_table_is_read_back_to_the_bit(suffix: str, tmp_path: Path) -> None:
    table, path = made_up(), tmp_path / f"t{suffix}"
    mw.write_table(path, table)
    again = mw.read_table(path)
    assert np.array_equal(again.time, table.time)
    assert np.array_equal(again.values, table.values)
    assert again.names == table.names
    assert suffix == ".csv" or again.metadata["subject"] == "3"
    assert np.array_equal(again["a b"], table.values[:, 1])
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize(("text", "degrees"), [(V1, True), (V3, False), (SIMM, False)])
def test_headers_of_every_version_are_read(text: str, degrees: bool, tmp_path: Path) -> None:
    path = tmp_path / "t.mot"
    path.write_text(text)
    table = mw.read_table(path)
    assert table.names == ("a", "b")
    assert table.time.tolist() == [0.0, 0.5]
    assert table.values.tolist() == [[1.0, 2.0], [3.0, 4.0]]
    assert table.in_degrees == degrees


def test_arrays_of_an_npz_file_become_columns(tmp_path: Path) -> None:
    path = tmp_path / "t.npz"
    qpos = np.arange(6.0).reshape(3, 2)
    np.savez(path, time=np.arange(3.0), qpos=qpos, force=np.arange(3))
    table = mw.read_table(path)
    assert table.names == ("qpos[0]", "qpos[1]", "force")
    assert np.array_equal(table.values[:, :2], qpos)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (ROWS, "no line 'endheader'"),
        (V1.replace("nRows=2", "nRows=3"), "its header says nRows=3, but there are 2: is it cut short"),
        (V1.replace("nColumns=3", "nColumns=x"), "nColumns=x, but there are 3"),
        (SIMM.replace("datarows 2", "datarows 9"), "nRows=9, but there are 2"),
        (V3.replace("double", "Vec3"), "has Vec3 in its cells"),
        (V3.replace("0.5\t3\t4", "0.5\t3"), "line 8: 2 cells where the header has 3"),
        (V3.replace("0.5\t3\t4", "0.5\t3\tx"), "line 8, column 'b': 'x' is not a number"),
        (V3.replace("0.5\t3\t4", "0\t3\t4"), "line 8: time 0 does not come after 0"),
        (V3.replace("0.5\t3\t4", "0.5\t3\tnan"), "line 8, column 'b': nan is not finite"),
        (V3.replace("\tb\n", "\ta\n"), "a name that no other has; check a"),
        (V3.replace("time", "t"), "no column 'time'"),
        (V3[: V3.index("time")], "no line of names after 'endheader'"),
        (V3[: V3.index("0\t1")], "a header but no rows"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(text: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "t.sto"
    path.write_text(text)
    with pytest.raises(mw.TableError, match=told) as caught:
        mw.read_table(path)
    assert "t.sto" in str(caught.value)


def test_what_is_not_finite_can_be_let_in(tmp_path: Path) -> None:
    for suffix in (".sto", ".csv", ".npz"):
        path = tmp_path / f"t{suffix}"
        mw.write_table(path, mw.Table(np.arange(2.0), ("a",), np.array([[np.nan], [1.0]])))
        with pytest.raises(mw.TableError, match="column 'a'"):
            mw.read_table(path)
        assert np.isnan(mw.read_table(path, finite=False)["a"][0])


@pytest.mark.parametrize(
    ("arrays", "told"),
    [
        ({"qpos": np.zeros(3)}, "no array 'time'"),
        ({"time": np.arange(3.0), "qpos": np.zeros((4, 2))}, r"'qpos'.*shape \(4, 2\)"),
        ({"time": np.arange(3.0), "name": np.array(["a"] * 3)}, "'name'"),
        ({"time": np.array([0.0, 2.0, 1.0]), "q": np.zeros(3)}, "time 1 in row 3"),
        ({"time": np.arange(3.0), "q": np.array([None] * 3)}, "plain arrays"),
    ],
)
def test_a_wrong_npz_file_is_told(arrays: dict[str, np.ndarray], told: str, tmp_path: Path) -> None:
    np.savez(tmp_path / "t.npz", **arrays)  # pyright: ignore[reportArgumentType]
    with pytest.raises(mw.TableError, match=told):
        mw.read_table(tmp_path / "t.npz")
    (tmp_path / "t.npz").write_bytes(b"no archive")
    with pytest.raises(mw.TableError, match=r"t\.npz"):
        mw.read_table(tmp_path / "t.npz")


def test_a_table_that_cannot_be_written_leaves_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "t.sto"
    mw.write_table(path, made_up())
    before = path.read_bytes()
    with pytest.raises(mw.TableError, match="must not contain tabs"):
        mw.write_table(path, mw.Table(np.arange(2.0), ("a\tb",), np.zeros((2, 1))))
    assert [p.name for p in tmp_path.iterdir()] == ["t.sto"]
    assert path.read_bytes() == before
    with pytest.raises(mw.TableError, match="must end in"):
        mw.write_table(tmp_path / "t.xlsx", made_up())
    with pytest.raises(mw.TableError, match="is not a folder"):
        mw.write_table(path / "missing" / "t.csv", made_up())


@pytest.mark.parametrize(
    ("time", "names", "shape", "told"),
    [
        ([0.0, 1.0], ("a",), (2, 2), "do not fit"),
        ([0.0, 0.0], ("a",), (2, 1), "row 2"),
        ([0.0], ("",), (1, 1), "the empty names"),
    ],
)
def test_a_table_fits_together(
    time: list[float], names: tuple[str, ...], shape: tuple[int, int], told: str
) -> None:
    with pytest.raises(mw.TableError, match=told):
        mw.Table(np.array(time), names, np.zeros(shape))


def test_opensim_reads_what_is_written_and_the_other_way_round(tmp_path: Path) -> None:
    opensim = pytest.importorskip("opensim", reason="needs the opensim package")
    rng = np.random.default_rng(1)
    table = mw.Table(
        np.arange(5) / 7.0, ("length:BIC", "/forceset/TRI"), rng.normal(size=(5, 2)), {"inDegrees": "yes"}
    )
    ours, theirs = tmp_path / "ours.sto", tmp_path / "theirs.sto"
    mw.write_table(ours, table)
    read = opensim.TimeSeriesTable(str(ours))
    assert tuple(read.getColumnLabels()) == table.names
    assert np.array_equal(read.getIndependentColumn(), table.time)
    assert np.array_equal(read.getMatrix().to_numpy(), table.values)
    assert read.getTableMetaDataString("inDegrees") == "yes"
    storage = opensim.Storage(str(ours))  # what its older tools read
    assert (storage.getSize(), storage.isInDegrees()) == (5, True)

    opensim.STOFileAdapter.write(read, str(theirs))
    again = mw.read_table(theirs)
    assert again.names == table.names
    assert again.in_degrees
    # OpenSim writes fewer digits than it takes; what stands there is read by both alike
    assert np.array_equal(again.values, opensim.TimeSeriesTable(str(theirs)).getMatrix().to_numpy())
