"""Configurations, and data sets of objects seen by several cameras."""
import threading
from ctypes import addressof, byref, c_char_p, c_int32, c_uint32, sizeof
from functools import partial
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _native
from ._arrays import ArrayLike, Floats, address, doubles
from ._calls import run
from ._errors import InvalidArgument, check, direct
from ._handle import Handle, made
from ._library import lib
from ._text import PathLike, choice, encoded, flags_of, json_from, json_of, path_of, text_from
from .device import Device, default_device, whole
from .priors import Mesh

Config = Union[None, str, "dict[str, Any]"]


def texts(values: Sequence[str], what: str) -> Any:
    """The library's array of texts."""
    return (c_char_p * len(values))(*(encoded(each, what) for each in values))


def path_name(name: str) -> str:
    """The name of an object as one part of a path, for files that are named after it: %XX for
    whatever leads elsewhere or is forbidden on some system, at most 200 bytes."""
    return text_from(lib.splat_path_name, encoded(name, "name"))


def config_keys() -> List[Dict[str, Any]]:
    """All keys of a configuration: type, range, default, and a sentence about each."""
    keys: List[Dict[str, Any]] = json_from(lib.splat_config_keys)
    return keys


def config_presets() -> Dict[str, str]:
    """Names of the configurations of the published models, with a sentence about each."""
    return {row["name"]: row["about"] for row in json_from(lib.splat_config_presets)}


def config_preset(name: str) -> str:
    """The text of one of them, for `config_merge` and everything that takes a configuration."""
    return text_from(lib.splat_config_preset, encoded(name, "name"))


def config_merge(config: Config = None, *changes: str) -> str:
    """A configuration with every value, as JSON.

    config   text of a YAML or JSON file, or a dict; None: the defaults, the published cars model
    changes  "key=value", such as "opt.base_lr=1e-4"; later ones win
    Raises InvalidArgument: an unknown key, with the nearest known one; a value out of range.
    """
    return text_from(lib.splat_config_merge, json_of(config, "config"), texts(changes, "a change"),
                     len(changes))


def config_warnings(config: Config = None, *changes: str) -> List[str]:
    """What a training of a configuration would leave out, in sentences."""
    found: List[str] = json_from(lib.splat_config_check, json_of(config, "config"),
                                 texts(changes, "a change"), len(changes))["warnings"]
    return found


class Dataset(Handle):
    """The data set in a folder, read into host memory; needs no device.

    format       "store", "tables", "srn", "co3d", "nmr", "disn" (and its parts, "disn_easy",
                 "disn_hard", "disn_albedo"), "objaverse", "gso", "images"; None: by the folder
    split        "train", "val" or "test"
    category     of several in the folder: "cars", "hydrants"; None: the only one
    resolution   of the returned images, which are square; 0: as stored
    limit        use only this many objects; 0: all
    cache_bytes  for decoded images; 0: 1 GiB
    background   behind transparent pixels, RGB
    depth, normal, mask, plane  maps that are required
    lenient      keep objects with missing files, for `check`
    allow_missing  leave incomplete objects out instead of refusing them; `report["missing"]`
                 names them
    objects_file, excluded_file, views_file  lists that the published code reads: objects of
                 "objaverse" (JSON), sequences of "co3d" to leave out, test objects and source
                 views of "nmr"; paths, or in the folder of the data
    Raises NotFound, IoError, FormatError, InvalidArgument.
    """

    __slots__ = ("_maps", "_side", "_views")
    _kind = "dataset"

    def __init__(self, path: PathLike, *, format: Optional[str] = None, split: str = "train",
                 resolution: int = 0, limit: int = 0, cache_bytes: int = 0,
                 background: ArrayLike = (0, 0, 0), depth: bool = False, normal: bool = False,
                 mask: bool = False, plane: bool = False, lenient: bool = False,
                 allow_missing: bool = False,
                 objects_file: Optional[PathLike] = None,
                 excluded_file: Optional[PathLike] = None,
                 views_file: Optional[PathLike] = None,
                 category: Optional[str] = None) -> None:
        bits = _native.DataFlags
        desc = _native.splat_dataset_desc(struct_size=sizeof(_native.splat_dataset_desc))
        desc.flags = flags_of((depth, bits.DEPTH), (normal, bits.NORMAL), (mask, bits.MASK),
                              (plane, bits.PLANE), (lenient, bits.LENIENT),
                              (allow_missing, bits.ALLOW_MISSING))
        desc.path, desc.format = path_of(path), encoded(format, "format")
        desc.split, desc.category = encoded(split, "split"), encoded(category, "category")
        desc.resolution, desc.limit = whole(resolution, "resolution"), whole(limit, "limit")
        desc.cache_bytes = whole(cache_bytes, "cache_bytes", 64)
        desc.background[:] = doubles(background, (3,), "background").tolist()
        for name, file in (("objects_file", objects_file), ("excluded_file", excluded_file),
                           ("views_file", views_file)):
            setattr(desc, name, path_of(file, name))
        self._own(made("dataset", direct, lib.splat_dataset_open, byref(desc)))
        report = self.report
        self._side = int(report["resolution"])
        self._maps: List[str] = report["maps"]
        self._views: List[int] = report["views_of"]

    @property
    def report(self) -> Dict[str, Any]:
        """Format, split, counts, resolution, maps, and the names of the objects."""
        found: Dict[str, Any] = json_from(lib.splat_dataset_report, self.handle)
        return found

    def __len__(self) -> int:
        return len(self._views)

    def views(self, index: int) -> int:
        """How many views an object has."""
        return self._views[index]

    def read(self, index: int, views: Optional[Sequence[int]] = None) -> Dict[str, Floats]:
        """Read n views of an object, in the given order; None: all.

        Returns "images" [n,3,R,R], "view_to_world" [n,4,4], "quaternions" [n,4], "focals" [n,2],
        "origin_distances" [n], and where the data set has them "depths" [n,1,R,R], "normals"
        [n,3,R,R], "masks" [n,1,R,R], "planes" [n,5,R,R]; all float32. The world is the frame of the first view.
        Raises InvalidArgument (no such object or view), NotFound, FormatError.
        """
        numbers = view_numbers(self, index, views)
        n, side = len(numbers), self._side
        out = _native.splat_dataset_views(struct_size=sizeof(_native.splat_dataset_views))
        fields: List[Tuple[str, str, Tuple[int, ...]]] = [
            ("images", "image_count", (n, 3, side, side)),
            ("view_to_world", "view_to_world_count", (n, 4, 4)),
            ("quaternions", "quaternion_count", (n, 4)), ("focals", "focal_count", (n, 2)),
            ("origin_distances", "origin_distance_count", (n,))]
        fields += [(f"{name}s", f"{name}_count", (n, channels, side, side))
                   for name, channels in (("depth", 1), ("normal", 3), ("mask", 1), ("plane", 5))
                   if name in self._maps]
        arrays: Dict[str, Floats] = {}
        for name, count, shape in fields:
            arrays[name] = np.empty(shape, np.float32)
            setattr(out, name, address(arrays[name]))
            setattr(out, count, arrays[name].size)
        check(lib.splat_dataset_read(self.handle, whole(index, "index"), numbers, n, byref(out)))
        return arrays

    def check(self, index: int) -> Dict[str, Any]:
        """Check all files of an object: problems and warnings in sentences, and a hash."""
        found: Dict[str, Any] = json_from(lib.splat_dataset_check, self.handle,
                                          whole(index, "index"))
        return found

    def __repr__(self) -> str:
        return "Dataset(closed)" if self.closed else f"Dataset({len(self)} objects)"


def view_numbers(dataset: Dataset, index: int, views: Optional[Sequence[int]]) -> Any:
    """The library's array of view numbers; None: all of the object."""
    given = views
    if given is None:
        given = range(dataset.views(index) if 0 <= index < len(dataset) else 0)
    return (c_uint32 * len(given))(*(whole(each, "a view") for each in given))


def prepare_co3d(raw: PathLike, out: PathLike, category: str, *, subset: str = "fewview_dev",
                 split: str = "train", size: int = 0, limit: int = 0,
                 stored_poses: bool = False) -> Dict[str, int]:
    """Make the data set of the published code from a split of CO3D's raw release.

    category      "hydrant", "teddybear"
    size          of the images; 0: 128
    limit         only this many sequences; 0: all
    stored_poses  keep the release's cameras instead of normalised ones
    Returns the numbers of sequences, frames, and sequences that were kept or left out. Raises
    NotFound, IoError, FormatError, InvalidArgument.
    """
    desc = _native.splat_co3d_desc(struct_size=sizeof(_native.splat_co3d_desc))
    desc.flags = flags_of((stored_poses, _native.Co3dFlags.STORED_POSES))
    desc.raw, desc.out = path_of(raw, "raw"), path_of(out, "out")
    desc.category, desc.subset = encoded(category, "category"), encoded(subset, "subset")
    desc.split = encoded(split, "split")
    desc.size, desc.limit = whole(size, "size"), whole(limit, "limit")
    info = _native.splat_co3d_info(struct_size=sizeof(_native.splat_co3d_info))
    check(lib.splat_co3d_prepare(byref(desc), byref(info)))
    return {name: getattr(info, name) for name in ("sequences", "frames", "kept", "left_out")}


def write_tokens(data: PathLike, masks: PathLike, names: PathLike, out: PathLike, *,
                 dimension: int = 0, tokens: int = 0, pooled: bool = False,
                 format: Optional[str] = None, category: Optional[str] = None) -> Dict[str, int]:
    """Turn masks of classes and instances into tokens of each view, for `data.tokens_file`.

    masks      folder with SPLIT/OBJECT/ (of a data set without splits OBJECT/): a .png for each view
    names      .json: COCO's panoptic annotations; else a palette, lines "R G B name"
    out        .npz or .safetensors; an existing one is replaced
    dimension  numbers of a token, even, from 12; 0: 32, pooled 60
    tokens     of a view; 0: 16
    pooled     one vector for each view instead, for `data.embedding_file`
    Returns the numbers of objects, views, classes and segments, and of segments that were dropped.
    Raises NotFound, IoError, FormatError, Unsupported, InvalidArgument.
    """
    desc = _native.splat_tokens_desc(struct_size=sizeof(_native.splat_tokens_desc))
    desc.flags = flags_of((pooled, _native.TokensFlags.POOLED))
    desc.data, desc.masks = path_of(data, "data"), path_of(masks, "masks")
    desc.names, desc.out = path_of(names, "names"), path_of(out, "out")
    desc.format, desc.category = encoded(format, "format"), encoded(category, "category")
    desc.dimension, desc.tokens = whole(dimension, "dimension"), whole(tokens, "tokens")
    info = _native.splat_tokens_info(struct_size=sizeof(_native.splat_tokens_info))
    check(lib.splat_tokens_write(byref(desc), byref(info)))
    return {name: getattr(info, name)
            for name in ("objects", "views", "classes", "segments", "dropped")}


def write_synthetic(path: PathLike, *, category: str = "cars", seed: int = 0, resolution: int = 0,
                    train_views: int = 0, test_views: int = 0, train: int = 0, val: int = 0,
                    test: int = 0) -> None:
    """Write procedural objects with exact maps, in the layout of SRN's data.

    category          "cars", "chairs" or "mixed"
    resolution        8 to 2048; 0: 128
    *_views           of each object; 0: 50 of train, 251 of the others
    train, val, test  how many objects; existing ones are left alone
    """
    desc = _native.splat_synthetic_desc(struct_size=sizeof(_native.splat_synthetic_desc))
    desc.path, desc.category = path_of(path), encoded(category, "category")
    desc.seed, desc.resolution = whole(seed, "seed", 64), whole(resolution, "resolution")
    desc.train_views = whole(train_views, "train_views")
    desc.test_views = whole(test_views, "test_views")
    desc.train_objects, desc.val_objects = whole(train, "train"), whole(val, "val")
    desc.test_objects = whole(test, "test")
    for index in range(train + val + test):
        check(lib.splat_synthetic_write(byref(desc), index))


VIEW_MAPS = ("depth", "normal", "mask", "albedo")  # beside pictures of meshes


class MeshViews:
    """A data set that meshes are drawn into: what all of its objects have in common.

    path        folder of the data set
    layout      "srn", or "images": folders with transforms.json
    category    in names of folders
    prepared    how meshes were made ready, such as "unit_diagonal", in words that are the same for all
    seed        with an object's name it decides all that is random
    size        side of the images, 8 to 2048
    *_views     of an object of train, and of val and test
    samples     of a pixel's side: 1, 2, 4 or 8
    points      on the surface, in points.ply; 0: none
    maps        "depth", "normal", "mask" and "albedo": what is written besides pictures
    y_up        y is up in the meshes, as in glTF; z is up in the data set
    protocol    where cameras stand: "sphere", "hemisphere", "orbit"
    background  "white", "black", "gray", "plain", "gradient"
    distance    of the cameras from the origin
    fov_x       radians; 0: SRN's
    elevation   of an orbit above the horizon, radians
    jitter      radians: cameras roll, and aim beside the origin, by up to this angle
    exposure    stops: objects are darker or brighter by up to this
    """

    __slots__ = ("_shared",)

    def __init__(self, path: PathLike, *, layout: str = "srn", category: str = "objects",
                 prepared: str = "", seed: int = 0, size: int = 128, train_views: int = 50,
                 test_views: int = 251, samples: int = 4, points: int = 10000,
                 maps: Sequence[str] = ("depth", "normal", "mask"), y_up: bool = False,
                 protocol: Union[int, _native.MeshProtocolName] = "sphere",
                 background: Union[int, _native.MeshBackgroundName] = "white", distance: float = 1.3,
                 fov_x: float = 0, elevation: float = 0, jitter: float = 0, exposure: float = 0) -> None:
        desc = _native.splat_mesh_views_desc(struct_size=sizeof(_native.splat_mesh_views_desc))
        for name in maps:
            if name not in VIEW_MAPS:
                raise InvalidArgument(f"maps has {name!r}, expected {', '.join(VIEW_MAPS)}")
            desc.flags |= int(_native.MeshViewsFlags[name.upper()])
        desc.flags |= flags_of((y_up, _native.MeshViewsFlags.Y_UP))
        desc.path, desc.layout = path_of(path), encoded(layout, "layout")
        desc.category, desc.prepared = encoded(category, "category"), encoded(prepared, "prepared")
        desc.seed, desc.size = whole(seed, "seed", 64), whole(size, "size")
        desc.train_views = whole(train_views, "train_views")
        desc.test_views = whole(test_views, "test_views")
        desc.samples, desc.points = whole(samples, "samples"), whole(points, "points")
        desc.protocol = choice(_native.MeshProtocol, protocol, "protocol")
        desc.background = choice(_native.MeshBackground, background, "background")
        desc.distance, desc.fov_x, desc.elevation = distance, fov_x, elevation
        desc.jitter, desc.exposure = jitter, exposure
        self._shared = desc

    def _of(self, name: str, split: str) -> Any:
        """The description of one object."""
        desc = _native.splat_mesh_views_desc.from_buffer_copy(self._shared)
        desc.name, desc.split = encoded(name, "name"), encoded(split, "split")
        return desc

    def has(self, name: str, split: str = "train") -> bool:
        """True if the object is there already. Raises InvalidArgument (also for a folder of data made
        with other values, and for an object that another split has), Unsupported, IoError."""
        found = c_int32()
        check(lib.splat_mesh_find_views(byref(self._of(name, split)), byref(found)))
        return bool(found.value)

    def write(self, mesh: Mesh, name: str, split: str = "train", *,
              device: Optional[Device] = None) -> None:
        """Draw a mesh as an object, whose folder appears whole or not at all; one that is there is kept.

        device  None: the default device
        Raises as `has`, FormatError (a mesh without area, or that no view shows), NotFound, Cancelled.
        """
        device = default_device() if device is None else device
        run(partial(lib.splat_device_cancel, device.handle), None, lib.splat_mesh_write_views,
            mesh.handle, device.handle, byref(self._of(name, split)))


Progress = Callable[[int, int], object]


def _run(call: Callable[[Any], Any], progress: Optional[Progress]) -> None:
    """Call with a function of C, which `progress` or a signal ends by raising."""
    stop = threading.Event()
    raised: List[BaseException] = []

    def report(user: Any, done: int, total: int) -> int:
        try:
            if progress is not None and not stop.is_set():
                progress(done, total)
        except BaseException as error:
            raised.append(error)
            stop.set()
        return int(stop.is_set())

    def work() -> int:
        code: int = call(_native.splat_progress_callback(report))
        if raised:
            raise raised.pop()  # the traceback keeps the list
        return code

    run(stop.set, None, work)


def import_tables(path: PathLike, out: Optional[PathLike] = None, *, split: str = "train",
                  replace: bool = False, duckdb: Optional[PathLike] = None,
                  shard: Tuple[int, int] = (0, 1), progress: Optional[Progress] = None) -> None:
    """Copy a split of tables in Parquet files to a store, which `Dataset` reads fast.

    out       folder of the store, `<out>/<split>/`; None: where `Dataset(path)` looks
    replace   remove an import of other tables in the folder
    duckdb    DuckDB's library; None: SPLAT_DUCKDB_LIBRARY, or found
    shard     (i, n): part i of n, which n processes do; the last to end completes the store
    progress  called with the rows done and all rows, on a thread of its own if this one is the main
              thread; what it raises ends the import, as Ctrl-C does, which goes on when it is called
              again
    Raises NotFound (tables, DuckDB), FormatError with table, column and row, IoError.
    """
    desc = _native.splat_dataset_import_desc(struct_size=sizeof(_native.splat_dataset_import_desc))
    desc.flags = int(_native.ImportFlags.REPLACE) if replace else 0
    desc.path, desc.split = path_of(path), encoded(split, "split")
    desc.out = None if out is None else path_of(out)
    desc.duckdb = None if duckdb is None else path_of(duckdb)
    desc.shard, desc.shards = (whole(each, "a shard") for each in shard)
    _run(lambda report: lib.splat_dataset_import(byref(desc), report, None), progress)


def export_dataset(dataset: Dataset, path: PathLike, *, layout: str = "tables",
                   split: Optional[str] = None, category: str = "cars",
                   objects: Optional[Sequence[int]] = None, duckdb: Optional[PathLike] = None,
                   shard: Tuple[int, int] = (0, 1), progress: Optional[Progress] = None) -> None:
    """Write a data set with its cameras, images and maps, as 8 bits at its resolution.

    layout    "tables" (Parquet files), "srn" or "images" (folders), or "store"
    split     to write; None: that of the data set
    objects   their numbers; None: all
    shard, progress  as of `import_tables`; shards of a store only
    Raises InvalidArgument (another export in the folder), Unsupported, NotFound (DuckDB), IoError.
    """
    desc = _native.splat_dataset_export_desc(struct_size=sizeof(_native.splat_dataset_export_desc))
    desc.path, desc.layout = path_of(path), encoded(layout, "layout")
    desc.split, desc.category = encoded(split, "split"), encoded(category, "category")
    desc.duckdb = None if duckdb is None else path_of(duckdb)
    desc.shard, desc.shards = (whole(each, "a shard") for each in shard)
    if objects is not None:
        numbers = (c_uint32 * max(len(objects), 1))(*(whole(each, "an object") for each in objects))
        desc.objects, desc.object_count = addressof(numbers), len(objects)
        desc.kept = numbers  # kept as long as the call runs
    _run(lambda report: lib.splat_dataset_export(dataset.handle, byref(desc), report, None),
         progress)
