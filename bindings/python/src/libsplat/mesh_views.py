"""Meshes as objects of a data set."""
from ctypes import byref, c_int32, sizeof
from functools import partial
from typing import Any, Optional, Sequence, Union

from . import _native
from ._calls import run
from ._errors import InvalidArgument, check
from ._library import lib
from ._text import PathLike, choice, encoded, flags_of, path_of
from .device import Device, default_device, whole
from .mesh import Mesh

MAPS = ("depth", "normal", "mask", "albedo")


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

    def __init__(self, path: PathLike, *, layout: str = "srn", category: str = "objects",
                 prepared: str = "", seed: int = 0, size: int = 128, train_views: int = 50,
                 test_views: int = 251, samples: int = 4, points: int = 10000,
                 maps: Sequence[str] = ("depth", "normal", "mask"), y_up: bool = False,
                 protocol: Union[int, _native.MeshProtocolName] = "sphere",
                 background: Union[int, _native.MeshBackgroundName] = "white", distance: float = 1.3,
                 fov_x: float = 0, elevation: float = 0, jitter: float = 0, exposure: float = 0) -> None:
        desc = _native.splat_mesh_views_desc(struct_size=sizeof(_native.splat_mesh_views_desc))
        for name in maps:
            if name not in MAPS:
                raise InvalidArgument(f"maps has {name!r}, expected {', '.join(MAPS)}")
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
