"""How good depth maps, normals and masks are, and shapes against true points.

Maps are pixels [height,width] or [height,width,3], or an `Image`: uint8 (0 to 255 stand for 0 to
1), float16 or float32. Numbers that are not finite are refused, unless a mask leaves them out.
"""
from ctypes import byref, c_uint64, sizeof
from typing import Any, Optional, Tuple, Union

import numpy as np

from . import _native
from ._arrays import ArrayLike, Floats, address, image_struct, pixel_array
from ._errors import check
from ._library import lib
from ._records import DepthScores, FidelityScores, MaskScores, NormalScores
from ._text import PathLike, choice, flags_of, path_of
from .camera import Camera
from .device import whole


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


def filter_map(data: ArrayLike, filter: Union[int, str]) -> Floats:
    """Edges of a map ("canny", "sobel", "scharr", "prewitt"), or a mask without holes ("closing")
    or specks ("opening"), as float32 [height,width]."""
    image = _map(data, "data")
    filtered = np.empty((image.height, image.width), np.float32)
    check(lib.splat_prior_filter(byref(image), choice(_native.MapFilter, filter, "filter"),
                                 byref(image_struct(filtered))))
    return filtered


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
