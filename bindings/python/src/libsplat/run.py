"""Runs: a task with its folder, one piece of work per call. Fits of photographs are runs."""
import threading
from ctypes import byref, sizeof
from dataclasses import dataclass, field, fields
from typing import Any, Dict, Iterator, List, Literal, Optional, Sequence, Union

import numpy as np

from . import _native
from ._arrays import ByValue, Floats
from ._dlpack import Memory
from ._errors import InvalidArgument, check
from ._handle import Handle, made
from ._library import lib
from ._records import RunEvent
from ._text import PathLike, choice, flags_of, json_from, path_of
from .dataset import texts
from .device import Device, default_device, real, whole
from .scene import Scene

ENDS = (_native.RunEventKind.DONE, _native.RunEventKind.INTERRUPTED,
        _native.RunEventKind.NOT_FINITE, _native.RunEventKind.NOTHING_DRAWN)


@dataclass(frozen=True, eq=False)
class Event(ByValue, RunEvent):
    """What one piece of a run did; `kind` says which fields have values.

    numbers        by their names in metrics.jsonl, such as "loss", "psnr" and "val_psnr"
    drawn, truths  of a validated piece, float32 [views,3,height,width]
    """

    numbers: Dict[str, float] = field(default_factory=dict)
    drawn: Optional[Floats] = None
    truths: Optional[Floats] = None

    @property
    def ends(self) -> bool:
        """True if the run is over."""
        return self.kind in ENDS


def _copy(pointer: Optional[int], event: Any) -> Optional[Floats]:
    """A copy of the images of an event."""
    if not pointer or event.image_count == 0:
        return None
    shape = (event.views, 3, event.height, event.width)
    return np.array(np.asarray(Memory(pointer, shape, np.dtype(np.float32), True)))


def _event(raw: Any) -> Event:
    """A copy of an event."""
    facts = RunEvent.of(raw)
    numbers = raw.numbers[:raw.number_count] if raw.number_count else ()
    return Event(**{each.name: getattr(facts, each.name) for each in fields(facts)},
                 numbers={each.name.decode(): each.value for each in numbers},
                 drawn=_copy(raw.images, raw), truths=_copy(raw.truths, raw))


class Run(Handle):
    """A task with its folder: an iterator of events. `Training` and `Fit` open one.

    A run that ends anywhere and is resumed has the same bits as one without an interruption.
    """

    __slots__ = ("_ended",)
    _kind = "run"
    _ended: bool

    def _begin(self) -> None:
        self._ended = False

    def next(self) -> Event:
        """Do the next piece of work: a step, one piece of a validation, a saved state.

        After the end it gives the last event again, without text. After an error or Ctrl-C the next
        call tries the same piece.
        """
        raw = _native.splat_run_event(struct_size=sizeof(_native.splat_run_event))
        events: List[Event] = []

        def call() -> int:  # with the lock: what `raw` points to is lent until the next call
            with self._lent() as kept:
                code: int = lib.splat_run_next(kept.handle, byref(raw))
                if code >= 0:
                    events.append(_event(raw))
                return code

        self._run(call)
        self._ended = events[0].ends
        return events[0]

    def __iter__(self) -> Iterator[Event]:
        return self

    def __next__(self) -> Event:
        if self._ended:
            raise StopIteration
        return self.next()

    def interrupt(self) -> None:
        """Let the next event save the state and end the run. Any thread may call it."""
        check(lib.splat_run_interrupt(self.handle))

    @property
    def report(self) -> Dict[str, Any]:
        """Step, loss, scores and memory so far."""
        found: Dict[str, Any] = json_from(lib.splat_run_report, self.handle)
        return found


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
