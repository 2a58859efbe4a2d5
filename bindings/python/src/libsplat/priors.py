"""Depth maps, normals and masks: made of pictures, and how good they are; shapes against true points.

Maps are pixels [height,width] or [height,width,3], or an `Image`: uint8 (0 to 255 stand for 0 to
1), float16 or float32. Numbers that are not finite are refused, unless a mask leaves them out.
"""
from contextlib import suppress
from ctypes import byref, c_double, c_int32, c_uint64, sizeof
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arrays import ArrayLike, Floats, address, image_struct, pixel_array
from ._errors import Error, InvalidArgument, NotFound, check, direct
from ._handle import Handle, made
from ._library import lib
from ._records import (DepthScores, FidelityScores, MaskScores, NormalScores,
                       PriorModelInfo)
from ._text import (PathLike, choice, encoded, flags_of, json_from, json_of, path_of,
                    text_from)
from .camera import Camera
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


def normals_from_depth(depth: ArrayLike, focal: float, *, center: Tuple[float, float] = (0, 0),
                       distances: Tuple[float, float] = (0, 0)) -> Floats:
    """Normals [height,width,3] as (n + 1) / 2 in the camera's axes, of the surface that a depth map shows.

    focal      pixels
    center     principal point; both 0: the middle
    distances  nearest and farthest of a map of relative depth; both 0: the map holds distances
    Raises ShapeMismatch, InvalidArgument.
    """
    image = _map(depth, "depth")
    desc = _empty(_native.splat_normals_desc)
    desc.focal_x = desc.focal_y = focal
    desc.center_x, desc.center_y = center
    desc.nearest, desc.farthest = distances
    normal = np.empty((image.height, image.width, 3), np.float32)
    check(lib.splat_normals_from_depth(byref(image), byref(desc), byref(image_struct(normal))))
    return normal


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
