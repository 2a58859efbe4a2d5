"""The rasterizer: Gaussians and cameras to images, and gradients back."""
import threading
from ctypes import byref, sizeof
from functools import partial
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union, overload

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arrays import PIXELS, ArrayLike, Floats, background_of, image_struct
from ._calls import run
from ._errors import InvalidArgument, InvalidState, check, direct
from ._handle import Handle, made
from ._library import lib
from ._records import RasterizerInfo
from ._text import choice, flags_of
from .camera import Camera, camera_array
from .device import Device, default_device, whole
from .image import Image
from .scene import Scene
from .tensor import Tensor, tensor_of

Output = _native.Output
Cameras = Union[Camera, Sequence[Camera]]

# Axes behind the views of each output: pixels or Gaussians, and components.
PIXEL_OUTPUTS = {Output.RGB: (3,), Output.ALPHA: (), Output.DEPTH: (), Output.EXPECTED_DEPTH: (),
                 Output.CONTRIBUTORS: (), Output.NORMALS: (3,), Output.IDS: (), Output.MEDIAN_DEPTH: ()}
GAUSSIAN_OUTPUTS = {Output.MEANS2D: (2,), Output.RADII: (2,), Output.CONICS: (3,),
                    Output.DEPTHS: (), Output.VISIBILITY: ()}


class RasterState(Handle):
    """Memory of one forward call with its images, and of what its backward call needs."""

    __slots__ = ()
    _kind = "raster_state"

    def __init__(self, rasterizer: "Rasterizer") -> None:
        self._own(made("raster_state", rasterizer._call, lib.splat_raster_state_create,
                       rasterizer.handle), rasterizer.device)


class Rasterizer(Handle):
    """Draws up to `gaussians` Gaussians into up to `views` images of up to width x height pixels.

    device         where it draws; None: the default device
    views          0: any number, with memory that grows with the calls
    items          most (Gaussian, view) pairs of a call, as the sum of its ranges; 0: gaussians x views
    width, height  pixels of the largest view; images of smaller cameras are 0 beyond their size
    sh_degree      0 to 3; 0 with direct_colors
    direct_colors  colours are RGB, not spherical harmonics
    antialiased    opacity compensates for the dilation
    sort_by_distance, cut_3_sigma  blend by the distance to the camera, not by depth; alpha is 0 beyond 3 sigma
    linear_colors  colours are linear: background and images are sRGB, outputs as arrays and tensors linear
    depth, normals, ids, median_depth  which outputs it has beside RGB and alpha; the last has no gradient
    backward       gradients; also from the depth (grad_depth), of the pose and of the intrinsics
                   (grad_pose, grad_intrinsics, convention "gsplat") and of the means in the image
                   (grad_means2d); contributions
    original_gradient  convention "3dgs": the gradient of the original code with its three quirks
    convention     "3dgs", "gsplat" or "ray_maximum" (no gradients); None: "3dgs"
    near, far      planes, scene units; 0: the convention's
    disabled_skips `SkipFlags` of work not to skip, for measuring
    Threads take turns on one rasterizer.
    """

    __slots__ = ("_size", "_terms")
    _kind = "rasterizer"

    def __init__(self, device: Optional[Device], gaussians: int, width: int, height: int, *,
                 views: int = 0, items: int = 0, sh_degree: int = 0, direct_colors: bool = False,
                 antialiased: bool = False, sort_by_distance: bool = False, cut_3_sigma: bool = False,
                 linear_colors: bool = False, depth: bool = False, normals: bool = False,
                 ids: bool = False, median_depth: bool = False, backward: bool = False, grad_depth: bool = False,
                 grad_pose: bool = False, grad_intrinsics: bool = False, grad_means2d: bool = False,
                 contributions: bool = False, original_gradient: bool = False,
                 convention: Union[None, int, _native.ConventionName] = None, near: float = 0.0, far: float = 0.0,
                 disabled_skips: int = 0) -> None:
        device = default_device() if device is None else device
        flags = _native.RasterizerFlags
        desc = _native.splat_rasterizer_desc(struct_size=sizeof(_native.splat_rasterizer_desc))
        desc.flags = flags_of((direct_colors, flags.DIRECT_COLORS),
                              (antialiased, flags.ANTIALIASED), (depth, flags.DEPTH),
                              (sort_by_distance, flags.SORT_BY_DISTANCE), (cut_3_sigma, flags.CUT_3_SIGMA),
                              (linear_colors, flags.LINEAR_COLORS),
                              (normals, flags.NORMALS), (backward, flags.BACKWARD),
                              (grad_depth, flags.GRAD_DEPTH), (grad_pose, flags.GRAD_POSE),
                              (grad_means2d, flags.GRAD_MEANS2D),
                              (grad_intrinsics, flags.GRAD_INTRINSICS),
                              (contributions, flags.CONTRIBUTIONS), (ids, flags.IDS),
                              (median_depth, flags.MEDIAN_DEPTH),
                              (original_gradient, flags.ORIGINAL_GRADIENT))
        desc.gaussians = whole(gaussians, "gaussians")
        desc.views = whole(views, "views")
        desc.items = whole(items, "items")
        desc.width, desc.height = whole(width, "width"), whole(height, "height")
        desc.sh_degree = whole(sh_degree, "sh_degree")
        desc.disabled_skips = whole(disabled_skips, "disabled_skips")
        desc.convention = choice(_native.Convention, convention, "convention")
        desc.near_plane, desc.far_plane = near, far
        self._own(made("rasterizer", direct, lib.splat_rasterizer_create, device.handle,
                       byref(desc)), device)
        self._lock = threading.RLock()
        self._size = (int(height), int(width))
        self._terms = 0 if direct_colors else (int(sh_degree) + 1)**2

    @property
    def device(self) -> Device:
        """Where it draws."""
        assert self._device is not None
        return self._device

    def state(self) -> RasterState:
        """One more state. With several, forward calls stay alive, and backward calls of them come
        in any order. Calls without a state use the rasterizer's own."""
        return RasterState(self)

    def forward(self, scene: Scene, cameras: Cameras, background: Optional[ArrayLike] = None, *,
                ranges: Optional[ArrayLike] = None, state: Optional[RasterState] = None) -> None:
        """Draw a scene; read the images with `read`, `output` or `images`.

        background  RGB; None: black
        ranges      int [views,2]: the first Gaussian that each view sees, and how many, as for objects that lie
                    one after the other; None: all. Each range costs what a call for it would, with the same bits
        Raises InvalidArgument (cameras that are too large, too many Gaussians, a range), Cancelled.
        """
        views = camera_array(cameras)
        if ranges is not None:
            desc = _native.splat_gaussians_desc(struct_size=sizeof(_native.splat_gaussians_desc))
            desc.scene = scene.handle
            kept = _see_ranges(desc, ranges)
            self._run(lib.splat_rasterizer_forward, self.handle, _handle_of(state), byref(desc), views,
                      len(views), background_of(background))
            del kept
            return
        self._run(lib.splat_rasterizer_forward_scene, self.handle, _handle_of(state), scene.handle,
                  views, len(views), background_of(background))

    def forward_arrays(self, cameras: Cameras, background: Optional[ArrayLike] = None, *,
                       means: Any, scales: Any, rotations: Any, opacities: Any, sh: Any = None,
                       colors: Any = None, active_tiles: Optional[ArrayLike] = None,
                       ranges: Optional[ArrayLike] = None, state: Optional[RasterState] = None) -> None:
        """Draw Gaussians that are tensors of the device, or arrays, which are copied there.

        means [n,3], scales [n,3] (standard deviations), rotations [n,4] w, x, y, z, opacities [n]
        0 to 1, and sh [n,K,3], or colors [n,3] with direct_colors; all float32.
        active_tiles  bool [views,ceil(height/16),ceil(width/16)]: pixels of tiles that are False are
        the background with alpha 0, and pass no gradient; None: all are drawn.
        ranges  as of forward.
        Raises ShapeMismatch, InvalidArgument, InvalidState (a mapped tensor), Cancelled.
        """
        desc = _native.splat_gaussians_desc(struct_size=sizeof(_native.splat_gaussians_desc))
        given = {"means": means, "scales": scales, "rotations": rotations, "opacities": opacities,
                 "sh": sh, "colors": colors}
        kept = {name: tensor_of(value, self.device, name) for name, value in given.items()
                if value is not None and np.shape(value) != (0,) and 0 not in np.shape(value)}
        for name, tensor in kept.items():
            setattr(desc, name, tensor.handle)
        if active_tiles is not None:
            tiles = np.ascontiguousarray(np.asarray(active_tiles) != 0).view(np.uint8)
            desc.active_tiles = tiles.ctypes.data
            desc.active_tile_count = tiles.size
        seen = None if ranges is None else _see_ranges(desc, ranges)
        views = camera_array(cameras)
        self._run(lib.splat_rasterizer_forward, self.handle, _handle_of(state), byref(desc), views,
                  len(views), background_of(background))
        del seen

    def info(self, state: Optional[RasterState] = None) -> RasterizerInfo:
        """What the last forward call of a state did; zeros before the first."""
        info = _native.splat_rasterizer_info(struct_size=sizeof(_native.splat_rasterizer_info))
        check(lib.splat_rasterizer_get_info(self.handle, _handle_of(state), byref(info)))
        return RasterizerInfo.of(info)

    def _drawn(self, state: Optional[RasterState]) -> RasterizerInfo:
        """Facts of the last forward call, whose shapes the outputs have."""
        info = self.info(state)
        if info.views == 0:
            raise InvalidState("no view has been drawn: call forward first")
        return info

    def _shape(self, output: Union[int, _native.OutputName], state: Optional[RasterState]
               ) -> Tuple[int, Tuple[int, ...]]:
        """Number and shape of an output of the last forward call."""
        code = Output(choice(Output, output, "output"))
        info = self._drawn(state)
        if code in PIXEL_OUTPUTS:
            return code, (info.views, *self._size, *PIXEL_OUTPUTS[code])
        if code not in GAUSSIAN_OUTPUTS:
            raise InvalidArgument(f"output is {int(code)}, which is none: see splat.Output")
        return code, (*_items_of(info), *GAUSSIAN_OUTPUTS[code])

    def read(self, output: Union[int, _native.OutputName] = "rgb", *, state: Optional[RasterState] = None
             ) -> Floats:
        """A copy of an output of the last forward call, float32 [views,...].

        output  "rgb" [V,H,W,3], "alpha", "depth", "expected_depth", "contributors", "ids", "median_depth"
                [V,H,W], "normals" [V,H,W,3]; of Gaussians "means2d", "radii" [V,N,2], "conics" [V,N,3],
                "depths", "visibility" [V,N]; if a view saw a range of fewer than N, [I,...]: the views'
                ranges one after the other, I Gaussians in all
        Raises InvalidState (no forward call, or an output that the rasterizer was not made for).
        """
        code, shape = self._shape(output, state)
        values = np.empty(shape, np.float32)
        self._call(lib.splat_rasterizer_read, self.handle, _handle_of(state), code,
                   values.ctypes.data, values.nbytes)
        return values

    def output(self, output: Union[int, _native.OutputName] = "rgb", *, into: Optional[Tensor] = None,
               state: Optional[RasterState] = None) -> Tensor:
        """The same as a tensor: a new one, or `into`, which has the output's shape."""
        code, shape = self._shape(output, state)
        tensor = Tensor.zeros(self.device, shape, name="output") if into is None else into
        self._run(lib.splat_rasterizer_output, self.handle, _handle_of(state), code, tensor.handle)
        return tensor

    def images(self, output: Union[int, _native.OutputName] = "rgb", *, channels: int = 0, dtype: Any = np.uint8,
               state: Optional[RasterState] = None) -> List[Image]:
        """The views of the last forward call as images, which notebooks show.

        channels  4: RGB and alpha; 0: those of the output
        dtype     uint8 (255 v, rounded and clamped), float16 or float32
        """
        code, shape = self._shape(output, state)
        if np.dtype(dtype) not in PIXELS:
            raise InvalidArgument(f"dtype is {np.dtype(dtype)}, expected uint8, float16 or float32")
        planes = whole(channels, "channels") or (shape[3] if len(shape) == 4 else 1)
        pixels: NDArray[Any] = np.empty((shape[0], *self._size, planes), dtype)
        structs = (_native.splat_image * shape[0])(*map(image_struct, pixels))
        self._call(lib.splat_rasterizer_read_images, self.handle, _handle_of(state), code, 0,
                   structs, shape[0])
        return [Image(each if planes > 1 else each[:, :, 0]) for each in pixels]

    def backward(self, wanted: Sequence[str], *, rgb: Any = None, alpha: Any = None,
                 depth: Any = None, into: Optional[Dict[str, Tensor]] = None,
                 accumulate: bool = False, state: Optional[RasterState] = None
                 ) -> Dict[str, Tensor]:
        """Gradients of a loss at the inputs of a state's last forward call.

        wanted            names of gradients: "means", "scales", "rotations", "opacities", "sh",
                          "colors", "means2d", "means2d_abs", "world_to_camera" [V,3,4],
                          "intrinsics" [V,4] (fx, fy, cx, cy); and "contributions" [N,2]: the sum of
                          each Gaussian's weights, and the number of pixels that see it
        rgb, alpha, depth gradients of the loss with respect to outputs, arrays or tensors; None: 0
        into              tensors to write to, by name; others are new
        accumulate        add to the contents of `into`
        Raises InvalidState (no forward call; a gradient that the rasterizer was not made for).
        """
        info = self._drawn(state)
        count, views = info.gaussians, info.views
        shapes = {"means": (count, 3), "scales": (count, 3), "rotations": (count, 4),
                  "opacities": (count,), "sh": (count, self._terms, 3), "colors": (count, 3),
                  "means2d": (*_items_of(info), 2), "means2d_abs": (*_items_of(info), 2),
                  "world_to_camera": (views, 3, 4), "intrinsics": (views, 4),
                  "contributions": (count, 2)}
        flags = flags_of((accumulate, _native.GradientFlags.ACCUMULATE))
        desc = _native.splat_gradients_desc(struct_size=sizeof(_native.splat_gradients_desc),
                                            flags=flags)
        kept: List[Tensor] = []
        for name, value in (("rgb", rgb), ("alpha", alpha), ("depth", depth)):
            if value is not None:
                kept.append(tensor_of(value, self.device, f"grad_{name}"))
                setattr(desc, f"grad_{name}", kept[-1].handle)
        gradients: Dict[str, Tensor] = {}
        for name in wanted:
            if name not in shapes:
                raise InvalidArgument(f"no gradient {name!r}, expected one of {', '.join(shapes)}")
            given = (into or {}).get(name)
            if given is None:
                given = Tensor.zeros(self.device, shapes[name], name=f"grad_{name}")
            gradients[name] = given
            setattr(desc, name if name == "contributions" else f"grad_{name}", given.handle)
        self._run(lib.splat_rasterizer_backward, self.handle, _handle_of(state), byref(desc))
        return gradients


def _see_ranges(desc: _native.splat_gaussians_desc, ranges: ArrayLike) -> NDArray[Any]:
    """Set the ranges of a call. Returns what must live until it ends."""
    given = np.asarray(ranges)
    if given.size > 0 and (given.ndim != 2 or given.shape[1] != 2 or given.dtype.kind not in "iu" or
                           given.min() < 0 or given.max() > 0xFFFFFFFF):
        raise InvalidArgument(f"ranges are {given.dtype} {list(given.shape)}, expected whole numbers [views,2]: "
                              "the first Gaussian, and how many")
    seen = np.ascontiguousarray(given, np.uint32)
    desc.view_ranges = seen.ctypes.data
    desc.view_range_count = seen.size
    return seen


def _items_of(info: RasterizerInfo) -> Tuple[int, ...]:
    """Axes of outputs of Gaussians: views and Gaussians, or the views' ranges one after the other."""
    whole_set = info.items == info.views * info.gaussians
    return (info.views, info.gaussians) if whole_set else (info.items,)


def _handle_of(state: Optional[RasterState]) -> Optional[int]:
    return None if state is None else state.handle


@overload
def render(scene: Scene, cameras: Camera, *, background: Optional[ArrayLike] = ...,
           alpha: bool = ..., device: Optional[Device] = ..., drawn_as: Optional[int] = ...) -> Image: ...


@overload
def render(scene: Scene, cameras: Sequence[Camera], *, background: Optional[ArrayLike] = ...,
           alpha: bool = ..., device: Optional[Device] = ...,
           drawn_as: Optional[int] = ...) -> List[Image]: ...


def render(scene: Scene, cameras: Cameras, *, background: Optional[ArrayLike] = (1, 1, 1),
           alpha: bool = False, device: Optional[Device] = None,
           drawn_as: Optional[int] = None) -> Union[Image, List[Image]]:
    """Draw a scene, uint8 RGB, or with its alpha. To draw again and again, keep a `Rasterizer`.

    cameras     one: returns its picture; or several, each of its own size: returns a list
    background  RGB; None: black
    device      None: the default device
    drawn_as    `DrawnFlags`; None: as the scene's file says (`info.drawn_as`)
    Raises InvalidArgument (a camera, drawn_as), Cancelled.
    """
    device = default_device() if device is None else device
    desc = _native.splat_scene_render_desc(struct_size=sizeof(_native.splat_scene_render_desc))
    if background is not None:
        desc.background = background_of(background)
    if drawn_as is not None:
        desc.flags, desc.as_given = whole(drawn_as, "drawn_as"), 1
    views = camera_array(cameras)
    pictures: List[NDArray[Any]] = [np.empty((each.height, each.width, 4 if alpha else 3), np.uint8)
                                    for each in views]
    images = (_native.splat_image * len(pictures))(*map(image_struct, pictures))
    run(partial(lib.splat_device_cancel, device.handle), None, lib.splat_scene_render,
        scene.handle, device.handle, views, len(views), byref(desc), images)
    drawn = [Image(each) for each in pictures]
    return drawn[0] if isinstance(cameras, Camera) else drawn
