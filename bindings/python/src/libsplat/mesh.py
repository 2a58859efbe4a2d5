"""Meshes of triangles: their files, points on them, pictures with exact maps, data sets of these."""
from ctypes import byref, c_int32, sizeof
from functools import partial
from typing import Any, Dict, List, Optional, Sequence, Union, overload

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arrays import (ArrayLike, Floats, address, background_of, check_shape, doubles, floats, image_struct,
                      pixel_array, typed_array)
from ._calls import run
from ._errors import InvalidArgument, ShapeMismatch, check, direct
from ._handle import Handle, made
from ._library import lib
from ._records import MeshInfo
from ._text import PathLike, choice, encoded, flags_of, json_from, path_of
from .camera import Camera, camera_array
from .device import Device, default_device, whole

# Channels of each map.
MESH_MAPS = {"color": 3, "albedo": 3, "mask": 1, "depth": 1, "normal": 3}
VIEW_MAPS = ("depth", "normal", "mask", "albedo")  # those of a data set
Maps = Dict[str, NDArray[np.float32]]


def _indices(data: ArrayLike, what: str) -> NDArray[np.uint32]:
    """Whole numbers of any type that uint32 holds."""
    array = np.asarray(data)
    if array.dtype.kind not in "iu":
        raise InvalidArgument(f"{what} has the type {array.dtype}, expected whole numbers")
    check_shape(array, (None, 3), what)
    if array.size and (array.min() < 0 or array.max() >= 2**32):
        raise InvalidArgument(f"{what} has {array.min() if array.min() < 0 else array.max()}, "
                              "expected 0 to 2^32 - 1")
    return np.ascontiguousarray(array, np.uint32)


class Mesh(Handle):
    """A surface of triangles in host memory.

    vertices      [n,3]
    triangles     [m,3], numbers of vertices
    normals       [n,3], of any lengths; None: those of the faces
    texcoords     [n,2], u and v, v from the top down
    colors        [n,4] RGBA, linear, 0 to 1
    texture       [height,width,4] uint8, sRGB and opacity, repeated
    base_color    linear RGB and opacity, which multiply all others
    single_sided  only the side is drawn on which the corners turn counterclockwise
    Arrays are copied. Points of an opacity below 1/2 are not there.
    Raises InvalidArgument, ShapeMismatch.
    """

    __slots__ = ()
    _kind = "mesh"

    def __init__(self, vertices: ArrayLike, triangles: ArrayLike, *, normals: Optional[ArrayLike] = None,
                 texcoords: Optional[ArrayLike] = None, colors: Optional[ArrayLike] = None,
                 texture: Optional[ArrayLike] = None, base_color: Sequence[float] = (1, 1, 1, 1),
                 single_sided: bool = False) -> None:
        places, corners = doubles(vertices, (None, 3), "vertices"), _indices(triangles, "triangles")
        count = len(places)
        desc = _native.splat_mesh_desc(struct_size=sizeof(_native.splat_mesh_desc))
        desc.flags = flags_of((single_sided, _native.MeshFlags.SINGLE_SIDED))
        if len(base_color) != 4:
            raise ShapeMismatch(f"base_color has {len(base_color)} numbers, expected 4")
        desc.base_color = tuple(base_color)
        kept: List[Any] = [places, corners]
        desc.vertices, desc.vertex_count = address(places), places.size
        desc.triangles, desc.triangle_count = address(corners), corners.size
        for name, data, columns in (("normal", normals, 3), ("texcoord", texcoords, 2),
                                    ("color", colors, 4)):
            if data is not None:
                array = floats(data, (count, columns), name + "s")
                kept.append(array)
                setattr(desc, name + "s", address(array))
                setattr(desc, name + "_count", array.size)
        if texture is not None:
            texels = np.ascontiguousarray(typed_array(texture, np.uint8, "texture"))
            check_shape(texels, (None, None, 4), "texture")
            kept.append(texels)
            desc.texture, desc.texture_count = address(texels), texels.size
            desc.texture_height, desc.texture_width = texels.shape[:2]
        self._own(made("mesh", direct, lib.splat_mesh_create, byref(desc)))

    @classmethod
    def load(cls, path: PathLike, *, lenient: bool = False, max_triangles: int = 0,
             max_texels: int = 0) -> "Mesh":
        """Read a .obj, .glb or .gltf file with its materials and textures.

        lenient        leave out textures and materials that cannot be read, see `report`
        max_triangles  refuse files with more; 0: 10^8
        max_texels     refuse files with more in all textures; 0: 2^27
        Raises NotFound, IoError, FormatError, Unsupported.
        """
        desc = _native.splat_mesh_file_desc(struct_size=sizeof(_native.splat_mesh_file_desc))
        desc.flags = flags_of((lenient, _native.MeshFlags.LENIENT))
        desc.max_triangles = whole(max_triangles, "max_triangles", 64)
        desc.max_texels = whole(max_texels, "max_texels", 64)
        return cls._of(made("mesh", direct, lib.splat_mesh_load, path_of(path), byref(desc)))

    @property
    def report(self) -> Dict[str, Any]:
        """What was left out of the mesh's file: {"warnings": [sentences]}."""
        found: Dict[str, Any] = json_from(lib.splat_mesh_load_report, self.handle)
        return found

    @property
    def info(self) -> MeshInfo:
        """Counts, bounds, area, memory."""
        info = _native.splat_mesh_info(struct_size=sizeof(_native.splat_mesh_info))
        check(lib.splat_mesh_get_info(self.handle, byref(info)))
        return MeshInfo.of(info)

    def normalise(self, size: Union[int, _native.MeshSizeName]) -> None:
        """Put the centre of the box into the origin, and make the mesh so large: "unit_cube",
        "unit_diagonal", "unit_sphere"; "as_given" changes nothing. Raises InvalidArgument."""
        check(lib.splat_mesh_normalise(self.handle, choice(_native.MeshSize, size, "size")))

    def sample(self, count: int, seed: int = 0) -> Floats:
        """Points [count,3] on the surface, uniform by area. Raises InvalidArgument."""
        points = np.empty((whole(count, "count"), 3), np.float32)
        check(lib.splat_mesh_sample(self.handle, whole(seed, "seed", 64), address(points), points.size))
        return points

    @overload
    def render(self, cameras: Camera, maps: Sequence[str] = ..., *, samples: int = ...,
               background: Optional[ArrayLike] = ..., up: Sequence[float] = ..., near_plane: float = ...,
               unlit: bool = ..., device: Optional[Device] = ...) -> Maps: ...

    @overload
    def render(self, cameras: Sequence[Camera], maps: Sequence[str] = ..., *, samples: int = ...,
               background: Optional[ArrayLike] = ..., up: Sequence[float] = ..., near_plane: float = ...,
               unlit: bool = ..., device: Optional[Device] = ...) -> List[Maps]: ...

    def render(self, cameras: Union[Camera, Sequence[Camera]], maps: Sequence[str] = ("color",), *,
               samples: int = 4, background: Optional[ArrayLike] = (1, 1, 1),
               up: Sequence[float] = (0, 0, 1), near_plane: float = 0, unlit: bool = False,
               device: Optional[Device] = None) -> Union[Maps, List[Maps]]:
        """Draw views: float32 maps by name, "color", "albedo" and "normal" [height,width,3], "mask" and
        "depth" [height,width]; depth and normals are exact, at the centres of pixels.

        cameras     one: returns its maps; or several: returns a list
        samples     of a pixel's side: 1, 2, 4 or 8
        background  RGB; None: black
        up          where the sky is; the main light comes from 45 degrees above the horizon
        near_plane  nearer points are not there; 0: 10^-3 of the box's diagonal
        unlit       color is the base colour
        device      None: the default device
        Raises InvalidArgument, Unsupported (a mesh too large for the device), Cancelled.
        """
        device = default_device() if device is None else device
        desc = _native.splat_mesh_render_desc(struct_size=sizeof(_native.splat_mesh_render_desc))
        desc.flags = flags_of((unlit, _native.MeshFlags.UNLIT))
        desc.samples, desc.near_plane = whole(samples, "samples"), near_plane
        if background is not None:
            desc.background = background_of(background)
        if len(up) != 3:
            raise ShapeMismatch(f"up has {len(up)} numbers, expected 3")
        desc.up = tuple(up)
        views = camera_array(cameras)
        raw = (_native.splat_mesh_maps * max(len(views), 1))()
        drawn: List[Maps] = []
        for view, images in zip(views, raw):
            drawn.append({})
            for name in maps:
                if name not in MESH_MAPS:
                    raise InvalidArgument(f"maps has {name!r}, expected {', '.join(MESH_MAPS)}")
                channels = MESH_MAPS[name]
                array = np.zeros((view.height, view.width) + ((channels,) if channels > 1 else ()), np.float32)
                drawn[-1][name] = array
                setattr(images, name, image_struct(pixel_array(array, name)))
        run(partial(lib.splat_device_cancel, device.handle), None, lib.splat_mesh_render, self.handle,
            device.handle, views, len(views), byref(desc), raw)
        return drawn[0] if isinstance(cameras, Camera) else drawn


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
