"""Fits: Gaussians from posed photographs."""
import threading
from ctypes import byref, sizeof
from typing import Literal, Optional, Sequence, Union

from . import _native
from ._errors import InvalidArgument
from ._handle import made
from ._library import lib
from ._text import PathLike, choice, flags_of, path_of
from .dataset import texts
from .device import Device, default_device, real, whole
from .run import Run
from .scene import Scene


class Fit(Run):
    """A fit of Gaussians to posed photographs, as a run: an iterator of events.

        with splat.Fit("run", "photos") as fit:
            for event in fit:
                print(event.text, event.numbers.get("loss"))
            fit.scene.save("scene.ply")

    Numbers of its events are, of a step, "loss", "psnr" of its photographs, "gaussians", "l1", "ssim" and
    milliseconds such as "raster_ms"; of photographs held out, "val_psnr" and "val_ssim". Fits of equal
    photographs, steps and seeds have equal bits.

    folder            receives configuration, log, metrics, states and Gaussians
    data              of photographs and cameras: a COLMAP project, or transforms.json and images;
                      None: the run's when resuming
    steps             None: as many as `seconds` take, about, on this device; None for both: 60 seconds
    max_gaussians     None: by the length of the fit
    sh_degree         of the spherical harmonics, 0 to 3; None: 3
    downscale         the sides of the photographs are divided by it; None: 1
    test_every        each so many photographs by name, with the first, are held out for scores; None: 8;
                      0: all are fitted
    cameras           "auto": a COLMAP model where there is one, else transforms.json; "colmap",
                      "transforms"
    masks             folder of masks, named like the photographs, 0 leaves out
    white_background  transparent photographs lie on white; else only opaque pixels count
    depth, normals    folders of maps, named like the photographs
    init              "points" of the data, "depth", "random", or the path of a scene; None: "points"
    memory            most bytes on the device; None: what it has
    refine            "poses" of the fitted photographs, "exposure", or both
    values            more options, "name=value", by the names of a run's config.json
    resume            go on from the latest state; what is given must equal the run's
    overwrite         replace the run in the folder
    Raises InvalidArgument, InvalidState (the folder is in use, or holds something else), NotFound,
    FormatError, Unsupported, ShapeMismatch, IoError; the folder is then untouched.
    """

    __slots__ = ()

    def __init__(self, folder: PathLike, data: Optional[PathLike] = None, *, steps: Optional[int] = None,
                 seconds: Optional[float] = None, max_gaussians: Optional[int] = None, sh_degree: Optional[int] = None,
                 downscale: Optional[int] = None, test_every: Optional[int] = None,
                 cameras: Union[int, _native.FitCamerasName] = "auto", masks: Optional[PathLike] = None,
                 white_background: bool = False, seed: int = 0, resume: bool = False,
                 overwrite: bool = False, device: Optional[Device] = None, depth: Optional[PathLike] = None,
                 normals: Optional[PathLike] = None, init: Optional[PathLike] = None,
                 memory: Optional[int] = None, refine: Sequence[Literal["poses", "exposure"]] = (),
                 values: Sequence[str] = ()) -> None:
        if data is None and not resume:
            raise InvalidArgument("data is None, expected a folder of photographs")
        for each in refine:
            if each not in ("poses", "exposure"):
                raise InvalidArgument(f'refine has {each!r}, expected "poses" and "exposure"')
        device = default_device() if device is None else device
        bits = _native.FitFlags
        desc = _native.splat_fit_desc(struct_size=sizeof(_native.splat_fit_desc))
        desc.test_every = whole(test_every or 0, "test_every")
        desc.flags = flags_of((resume, bits.RESUME), (overwrite, bits.OVERWRITE),
                              (test_every == 0, bits.ALL_PHOTOS),
                              (white_background, bits.WHITE_BACKGROUND),
                              ("poses" in refine, bits.REFINE_POSES), ("exposure" in refine, bits.REFINE_EXPOSURE))
        desc.folder, desc.data = path_of(folder, "folder"), path_of(data, "data")
        desc.masks, desc.depth = path_of(masks, "masks"), path_of(depth, "depth")
        desc.normals, desc.init = path_of(normals, "normals"), path_of(init, "init")
        desc.memory_bytes = whole(memory or 0, "memory", 64)
        desc.values, desc.value_count = texts(values, "a value"), len(values)
        desc.steps, desc.seed = whole(steps or 0, "steps", 64), whole(seed, "seed", 64)
        desc.seconds = real(seconds or 0, "seconds")
        desc.max_gaussians = whole(max_gaussians or 0, "max_gaussians")
        if sh_degree is not None:
            desc.sh_bands = whole(sh_degree, "sh_degree", 2) + 1
        desc.downscale = whole(downscale or 0, "downscale")
        desc.cameras = choice(_native.FitCameras, cameras, "cameras")
        self._own(made("run", device._run, lib.splat_fit_open, device.handle, byref(desc)), device)
        self._lock = threading.RLock()
        self._begin()

    @property
    def scene(self) -> Scene:
        """A copy of the Gaussians as they are, in the frame and units of the cameras."""
        return Scene._of(made("scene", self._run, lib.splat_fit_scene, self.handle))


class Scoring(Run):
    """The scores of any scene on photographs that are held out, as a run without a folder: an iterator of events.

        for event in splat.Scoring(scene, "photos", downscale=2):
            print(event.name, event.numbers)

    Of each photograph there is an event with its name, `drawn`, `truths`, "val_psnr" (dB) and "val_ssim", then one
    with their means, RunEventKind.VALIDATION. Only pixels count that the lens and the mask leave.

    scene             in the frame and units of the cameras
    data, downscale, test_every, cameras, masks, white_background   as of `Fit`; test_every=0 scores all photographs
    border            above 0 there are also "inner_psnr" and "inner_ssim" without this share of width and height
                      on each side
    Raises InvalidArgument, NotFound, FormatError, Unsupported, ShapeMismatch.
    """

    __slots__ = ()

    def __init__(self, scene: Scene, data: PathLike, *, downscale: Optional[int] = None,
                 test_every: Optional[int] = None, cameras: Union[int, _native.FitCamerasName] = "auto",
                 masks: Optional[PathLike] = None, white_background: bool = False, border: float = 0.0,
                 device: Optional[Device] = None) -> None:
        device = default_device() if device is None else device
        bits = _native.FitFlags
        desc = _native.splat_fit_desc(struct_size=sizeof(_native.splat_fit_desc))
        desc.flags = flags_of((test_every == 0, bits.ALL_PHOTOS), (white_background, bits.WHITE_BACKGROUND))
        desc.data, desc.masks = path_of(data, "data"), path_of(masks, "masks")
        desc.test_every = whole(test_every or 0, "test_every")
        desc.downscale = whole(downscale or 0, "downscale")
        desc.cameras = choice(_native.FitCameras, cameras, "cameras")
        self._own(made("run", device._run, lib.splat_fit_score, device.handle, byref(desc), scene.handle,
                       real(border, "border")), device)
        self._lock = threading.RLock()
        self._begin()
