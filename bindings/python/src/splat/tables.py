"""Tables in Parquet files: data sets to them and from them."""
from ctypes import addressof, byref, c_uint32, sizeof
from typing import Any, Callable, Optional, Sequence

from . import _native
from ._errors import check
from ._library import lib
from ._text import PathLike, encoded, path_of
from .dataset import Dataset
from .device import whole

Progress = Callable[[int, int], object]


def _run(call: Callable[[Any], Any], progress: Optional[Progress]) -> None:
    """Call with a function of C. What Python raises in it, such as Ctrl-C, is raised at the end."""
    raised = []

    def report(user: Any, done: int, total: int) -> int:
        try:
            if progress is not None:
                progress(done, total)
        except BaseException as error:
            raised.append(error)
            return 1
        return 0

    code = call(_native.splat_progress_callback(report))
    if raised:
        raise raised[0]
    check(code)


def import_tables(path: PathLike, out: Optional[PathLike] = None, *, split: str = "train",
                  replace: bool = False, duckdb: Optional[PathLike] = None,
                  progress: Optional[Progress] = None) -> None:
    """Copy a split of tables in Parquet files to a store, which `Dataset` reads fast.

    out       folder of the store, `<out>/<split>/`; None: where `Dataset(path)` looks
    replace   remove an import of other tables in the folder
    duckdb    DuckDB's library; None: SPLAT_DUCKDB_LIBRARY, or found
    progress  called with the rows done and all rows; what it raises ends the import, which goes on
              when it is called again
    Raises NotFound (tables, DuckDB), FormatError with table, column and row, IoError.
    """
    desc = _native.splat_dataset_import_desc(struct_size=sizeof(_native.splat_dataset_import_desc))
    desc.flags = int(_native.ImportFlags.REPLACE) if replace else 0
    desc.path, desc.split = path_of(path), encoded(split, "split")
    desc.out = None if out is None else path_of(out)
    desc.duckdb = None if duckdb is None else path_of(duckdb)
    _run(lambda report: lib.splat_dataset_import(byref(desc), report, None), progress)


def export_dataset(dataset: Dataset, path: PathLike, *, layout: str = "tables",
                   split: Optional[str] = None, category: str = "cars",
                   objects: Optional[Sequence[int]] = None, duckdb: Optional[PathLike] = None,
                   progress: Optional[Progress] = None) -> None:
    """Write a data set with its cameras, images and maps, as 8 bits at its resolution.

    layout    "tables" (Parquet files), "srn" (folders) or "store"
    split     to write; None: that of the data set
    objects   their numbers; None: all
    Raises InvalidArgument (another export in the folder), Unsupported, NotFound (DuckDB), IoError.
    """
    desc = _native.splat_dataset_export_desc(struct_size=sizeof(_native.splat_dataset_export_desc))
    desc.path, desc.layout = path_of(path), encoded(layout, "layout")
    desc.split, desc.category = encoded(split, "split"), encoded(category, "category")
    desc.duckdb = None if duckdb is None else path_of(duckdb)
    if objects is not None:
        numbers = (c_uint32 * max(len(objects), 1))(*(whole(each, "an object") for each in objects))
        desc.objects, desc.object_count = addressof(numbers), len(objects)
    _run(lambda report: lib.splat_dataset_export(dataset.handle, byref(desc), report, None),
         progress)
