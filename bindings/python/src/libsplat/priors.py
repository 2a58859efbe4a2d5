"""Depth maps, normals and masks: made of pictures, and how good they are; shapes against true points; meshes.

Maps are pixels [height,width] or [height,width,3], or an `Image`: uint8 (0 to 255 stand for 0 to
1), float16 or float32. Numbers that are not finite are refused, unless a mask leaves them out.
"""
from contextlib import suppress
from ctypes import byref, c_double, c_int32, c_uint64, sizeof
from functools import partial
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union, overload

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arrays import (ArrayLike, Floats, address, background_of, check_shape, doubles, floats, image_struct,
                      pixel_array, typed_array)
from ._calls import run
from ._errors import Error, InvalidArgument, NotFound, ShapeMismatch, check, direct
from ._handle import Handle, made
from ._library import lib
from ._records import (DepthScores, FidelityScores, MaskScores, MeshInfo, NormalScores,
                       PlaneScores, PriorModelInfo)
from ._text import (PathLike, choice, encoded, flags_of, json_from, json_of, path_of,
                    text_from)
from .camera import Camera, camera_array
from .device import Device, default_device, whole
from .weights import Weights


def _map(data: ArrayLike, what: str) -> _native.splat_image:
    return image_struct(pixel_array(data, what))


def _pair(a: ArrayLike, b: ArrayLike, names: Tuple[str, str]) -> Tuple[Any, Any]:
    return byref(_map(a, names[0])), byref(_map(b, names[1]))


def _optional(mask: Optional[ArrayLike]) -> Any:
    return None if mask is None else byref(_map(mask, "mask"))


def _empty(kind: Any) -> Any:
    return kind(struct_size=sizeof(kind))


def compare_depth(prediction: ArrayLike, truth: ArrayLike, mask: Optional[ArrayLike] = None, *,
                  published: bool = False) -> DepthScores:
    """Errors of a depth map after its alignment s p + t with the least squares.

    mask       pixels > 0.5 count; None: those with a truth > 0
    published  every pixel counts, as in the scores of Splatter Image with priors
    Raises ShapeMismatch, InvalidArgument.
    """
    scores = _empty(_native.splat_depth_scores)
    flags = flags_of((published, _native.DepthFlags.AS_PUBLISHED))
    check(lib.splat_prior_compare_depth(*_pair(prediction, truth, ("prediction", "truth")),
                                        _optional(mask), flags, byref(scores)))
    return DepthScores.of(scores)


def compare_normals(prediction: ArrayLike, truth: ArrayLike, mask: Optional[ArrayLike] = None, *,
                    vectors: bool = False) -> NormalScores:
    """Angles between normals, in degrees.

    mask     pixels > 0.5 count; None: those with a true normal
    vectors  numbers are x, y, z from -1 to 1, not (n + 1) / 2
    Raises ShapeMismatch, InvalidArgument.
    """
    scores = _empty(_native.splat_normal_scores)
    flags = flags_of((vectors, _native.NormalFlags.VECTORS))
    check(lib.splat_prior_compare_normals(*_pair(prediction, truth, ("prediction", "truth")),
                                          _optional(mask), flags, byref(scores)))
    return NormalScores.of(scores)


def compare_planes(prediction: ArrayLike, truth: ArrayLike, *, max_distance: float = 0.05,
                   max_degrees: float = 10, vectors: bool = True) -> PlaneScores:
    """Covering, recall and precision of planes [height,width,4]: normals and distances, <= 0 for none.

    max_distance  most difference of the distances of a plane that is found, as 5 cm of metres
    max_degrees   most angle between its normals
    vectors       normals are x, y, z from -1 to 1, not (n + 1) / 2
    Raises ShapeMismatch, InvalidArgument.
    """
    scores = _empty(_native.splat_plane_scores)
    check(lib.splat_prior_compare_planes(*_pair(prediction, truth, ("prediction", "truth")),
                                         flags_of((vectors, _native.NormalFlags.VECTORS)),
                                         max_distance, max_degrees, byref(scores)))
    return PlaneScores.of(scores)


def compare_masks(prediction: ArrayLike, alpha: ArrayLike, *, half: bool = False) -> MaskScores:
    """Overlap of a soft mask with the true one, which is where alpha > 0, or with `half` > 0.5.

    Raises ShapeMismatch, InvalidArgument.
    """
    scores = _empty(_native.splat_mask_scores)
    check(lib.splat_prior_compare_masks(*_pair(prediction, alpha, ("prediction", "alpha")),
                                        flags_of((half, _native.MaskFlags.ALPHA_HALF)),
                                        byref(scores)))
    return MaskScores.of(scores)


def compare_fidelity(prediction: ArrayLike, truth: ArrayLike, *, range_1: bool = False,
                     with_alpha: bool = False) -> FidelityScores:
    """Visual information fidelity of images in the pixel domain (Sheikh and Bovik 2006).

    range_1     compare values of 0 to 1 as they are, not 255 times them
    with_alpha  average in alpha
    Raises ShapeMismatch (also below 41 pixels), InvalidArgument.
    """
    scores = _empty(_native.splat_fidelity_scores)
    flags = flags_of((range_1, _native.FidelityFlags.RANGE_1),
                     (with_alpha, _native.FidelityFlags.WITH_ALPHA))
    check(lib.splat_prior_compare_images(*_pair(prediction, truth, ("prediction", "truth")), flags,
                                         byref(scores)))
    return FidelityScores.of(scores)


def filter_map(data: ArrayLike, filter: Union[int, _native.MapFilterName]) -> Floats:
    """Edges of a map ("canny", "sobel", "scharr", "prewitt"), or a mask without holes ("closing")
    or specks ("opening"), as float32 [height,width]."""
    image = _map(data, "data")
    filtered = np.empty((image.height, image.width), np.float32)
    check(lib.splat_prior_filter(byref(image), choice(_native.MapFilter, filter, "filter"),
                                 byref(image_struct(filtered))))
    return filtered


def picture_mask(picture: ArrayLike) -> Tuple[NDArray[np.uint8], _native.Found]:
    """The object of a picture [height,width,channels] without a network: by an alpha that is not opaque
    everywhere, else by the colour of its border. A mask [height,width] of 0 and 255, and how it was found."""
    array = pixel_array(picture, "picture")
    mask = np.empty(array.shape[:2], np.uint8)
    found = c_int32()
    check(lib.splat_picture_mask(byref(image_struct(array)), byref(image_struct(mask)), byref(found)))
    return mask, _native.Found(found.value)


def _camera(focal: float, center: Tuple[float, float], distances: Tuple[float, float]) -> Any:
    desc = _empty(_native.splat_normals_desc)
    desc.focal_x = desc.focal_y = focal
    desc.center_x, desc.center_y = center
    desc.nearest, desc.farthest = distances
    return desc


def normals_from_depth(depth: ArrayLike, focal: float, *, center: Tuple[float, float] = (0, 0),
                       distances: Tuple[float, float] = (0, 0)) -> Floats:
    """Normals [height,width,3] as (n + 1) / 2 in the camera's axes, of the surface that a depth map shows.

    focal      pixels
    center     principal point; both 0: the middle
    distances  nearest and farthest of a map of relative depth; both 0: the map holds distances
    Raises ShapeMismatch, InvalidArgument.
    """
    image = _map(depth, "depth")
    desc = _camera(focal, center, distances)
    normal = np.empty((image.height, image.width, 3), np.float32)
    check(lib.splat_normals_from_depth(byref(image), byref(desc), byref(image_struct(normal))))
    return normal


def planes_from_depth(depth: ArrayLike, focal: float, normal: Optional[ArrayLike] = None, *,
                      center: Tuple[float, float] = (0, 0), distances: Tuple[float, float] = (0, 0),
                      max_degrees: float = 0, max_offset: float = 0, least_share: float = 0) -> Floats:
    """Planes [height,width,4] of the surface that a depth map shows: the normal of each pixel's plane in the
    camera's axes, and its distance from the camera; 0 without a plane.

    normal       x, y, z [height,width,3]; None: by differences of the depth
    max_degrees  most angle between a pixel's normal and its plane's; 0: 15
    max_offset   most distance of a pixel from its plane, as a share of its depth; 0: 0.02
    least_share  share of the pixels of the smallest plane; 0: 0.005
    The rest as of normals_from_depth().
    Raises ShapeMismatch, InvalidArgument.
    """
    image = _map(depth, "depth")
    desc = _empty(_native.splat_planes_desc)
    desc.flags = _native.NormalFlags.VECTORS
    desc.max_degrees, desc.max_offset, desc.least_share = max_degrees, max_offset, least_share
    plane = np.empty((image.height, image.width, 4), np.float32)
    check(lib.splat_planes_from_depth(
        byref(image), None if normal is None else byref(_map(normal, "normal")),
        byref(_camera(focal, center, distances)), byref(desc), byref(image_struct(plane)), None))
    return plane


def mesh_points(path: PathLike, count: int, seed: int = 0) -> Floats:
    """Points [count,3] on the surface of an OBJ file, uniform by area.

    Raises NotFound, IoError, FormatError, Unsupported.
    """
    points = np.empty((whole(count, "count"), 3), np.float32)
    check(lib.splat_points_from_mesh(path_of(path), whole(seed, "seed"),
                                     points.ctypes.data, points.size))
    return points


def depth_points(depth: ArrayLike, camera: Camera) -> Floats:
    """The points [n,3] of the world that a depth map shows: distances along the camera's axis."""
    image = _map(depth, "depth")
    points = np.empty((image.width * image.height, 3), np.float32)
    needed = c_uint64()
    check(lib.splat_points_from_depth(byref(image), byref(camera.raw), address(points),
                                      points.size, byref(needed)))
    return points[:needed.value // 3].copy()


# Channels of each map, and its flag.
MAPS = {"depth": (1, _native.DataFlags.DEPTH), "normal": (3, _native.DataFlags.NORMAL),
        "mask": (1, _native.DataFlags.MASK)}


def prior_preset_text(name: Optional[str] = None) -> str:
    """The JSON of a preset as the library writes it; None: an array of all names. Raises NotFound."""
    return text_from(lib.splat_prior_preset, encoded(name, "name"))


def prior_presets() -> List[str]:
    """The names of all presets."""
    return list(json_from(lib.splat_prior_preset, None))


def prior_preset(name: str) -> Dict[str, Any]:
    """A preset: input, outputs, and where its model is had. Raises NotFound."""
    return dict(json_from(lib.splat_prior_preset, encoded(name, "name"))["preset"])


def _holds_weights(preset: Any, model: Optional[PathLike]) -> bool:
    """A model, or that of a preset of the library's, is a file of weights by its name or content."""
    if model is None and isinstance(preset, str) and "{" not in preset:
        with suppress(NotFound):
            model = json_from(lib.splat_prior_preset, encoded(preset, "preset"))["path"]
    if model is None or str(model).endswith((".pt", ".pth", ".safetensors")):
        return model is not None
    with suppress(Error):
        Weights.load(model)
        return True
    return False


class PriorModel(Handle):
    """A network that makes maps of pictures: an ONNX file that ONNX Runtime runs, or weights of MoGe-2.

    preset   a name of `prior_presets`, or a dict or JSON of one's own; None: by the name of the file
    model    the file; None: the preset's, in the folder of models
    runtime  the library of ONNX Runtime; None: where the library looks for it
    threads  of one run; 0: one per core
    device   of weights; None: the default device
    tokens   patches of a picture, for presets that have them; 0: the preset's
    numbers  float maps have the model's own numbers, not 0 to 1
    Raises NotFound (a file, ONNX Runtime), FormatError (a model of another interface).
    """

    __slots__ = ()
    _kind = "prior_model"

    def __init__(self, preset: Union[None, str, "dict[str, Any]"] = None,
                 model: Optional[PathLike] = None, *, runtime: Optional[PathLike] = None,
                 threads: int = 0, device: Optional[Device] = None, tokens: int = 0,
                 numbers: bool = False) -> None:
        desc = _native.splat_prior_model_desc(struct_size=sizeof(_native.splat_prior_model_desc))
        desc.flags = flags_of((numbers, _native.PriorModelFlags.NUMBERS))
        desc.preset, desc.model_path = json_of(preset, "preset"), path_of(model, "model")
        desc.runtime_path, desc.threads = path_of(runtime, "runtime"), whole(threads, "threads")
        desc.tokens = whole(tokens, "tokens")
        if device is None and _holds_weights(preset, model):
            device = default_device()
        if device is not None:
            desc.device = device.handle
        self._own(made("prior_model", direct, lib.splat_prior_model_create, byref(desc)))

    @property
    def info(self) -> PriorModelInfo:
        """What it makes, its licence, the size of its input."""
        info = _native.splat_prior_model_info(struct_size=sizeof(_native.splat_prior_model_info))
        with self._lent() as kept:
            check(lib.splat_prior_model_get_info(kept.handle, byref(info)))
            return PriorModelInfo.of(info)

    def run(self, picture: ArrayLike, maps: Optional[Sequence[str]] = None,
            dtype: Any = np.uint8) -> Dict[str, NDArray[Any]]:
        """Maps of a picture [height,width,channels], by name: "depth" and "mask" [height,width], "normal"
        [height,width,3].

        maps   the names; None: all that the model makes
        dtype  uint8, float16 or float32
        """
        return self._make(picture, maps, dtype, None)

    def run_focal(self, picture: ArrayLike, maps: Optional[Sequence[str]] = None,
                  dtype: Any = np.uint8) -> Tuple[Dict[str, NDArray[Any]], float]:
        """The same, and the focal length of the picture's camera, pixels; 0 if the model does not tell it."""
        focal = c_double()
        return self._make(picture, maps, dtype, focal), focal.value

    def _make(self, picture: ArrayLike, maps: Optional[Sequence[str]], dtype: Any,
              focal: Optional[c_double]) -> Dict[str, NDArray[Any]]:
        array = pixel_array(picture, "picture")
        flags = self.info.maps
        names = [name for name in MAPS if flags & MAPS[name][1]] if maps is None else list(maps)
        raw, found = _native.splat_prior_maps(), {}
        for name in names:
            if name not in MAPS:
                raise InvalidArgument(f"maps has {name!r}, expected {', '.join(MAPS)}")
            channels = MAPS[name][0]
            shape = array.shape[:2] + ((channels,) if channels > 1 else ())
            found[name] = np.zeros(shape, dtype)
            setattr(raw, name, image_struct(pixel_array(found[name], name)))
        image = image_struct(array)
        if focal is None:
            check(lib.splat_prior_model_run(self.handle, byref(image), byref(raw), 1))
        else:
            check(lib.splat_prior_model_run_focal(self.handle, byref(image), byref(raw),
                                                  byref(focal), 1))
        return found


# Channels of each map of a mesh.
MESH_MAPS = {"color": 3, "albedo": 3, "mask": 1, "depth": 1, "normal": 3}
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
