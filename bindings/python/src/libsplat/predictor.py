"""From pictures of an object to a scene."""
import sys
import threading
import warnings
from ctypes import byref, sizeof
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Optional, Sequence, Union

import numpy as np

from . import _native
from ._arrays import ByValue, Floats, address
from ._errors import check, direct
from ._handle import Handle, made
from ._library import lib
from ._records import PictureInfo, PredictorInfo
from ._text import PathLike, choice, json_from, json_of, path_of
from .camera import Camera
from .dataset import Dataset, view_numbers
from .device import Device, default_device, whole
from .picture import Picture, Source, picture_array
from .scene import Scene
from .weights import Weights


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(ByValue):
    """A predicted scene, in the frame of the first picture's camera, and facts of it.

    cameras   of the views, relative to the first
    pictures  what became of each picture; none for an object of a data set
    inputs    what the network saw, float32 [views,channels,R,R]
    report    the counts of Gaussians, times, and the warnings, which Python's `warnings` tells too
    """

    scene: Scene
    cameras: List[Camera]
    pictures: List[PictureInfo]
    inputs: Floats
    report: Dict[str, Any]

    def __repr__(self) -> str:
        seen = [f"{each.width} x {each.height} pixels, object {each.found.name.lower().replace('_', ' ')}"
                for each in self.pictures]
        doubts = [text for each in self.report["pictures"] for text in each["warnings"]]
        return (f"Prediction of {self.scene}, {self.report['faint']} faint ones left out\n"
                f"  seen: {'; '.join(seen) or 'views of a data set'}\n"
                f"  warnings: {'; '.join(doubts) or 'none'}")

    def _repr_png_(self) -> bytes:
        from .rasterizer import render
        return render(self.scene, self.cameras[0]).to_bytes("png")


class Predictor(Handle):
    """A network with weights that turns pictures of an object into a scene.

    device    None: the default device
    weights   a path, `Weights`, or the name of some that come with the library, such as "cars64",
              which None means
    config    text (JSON or YAML) or a dict; None: the file beside the weights
    adapters  a path, or `Weights`, of low-rank adapters, which are folded in with `alpha`, 0: that
              of their metadata
    aggregate   0, or 2 to 64: predictions from so many drawn views are joined, as those of F3D-Gaus
                from 8
    convention  how these views are drawn; None: "3dgs"
    What is doubtful, of the weights here or of a picture in `predict`, is a UserWarning.
    Raises NotFound (a file), ShapeMismatch or FormatError (weights that do not fit).
    """

    __slots__ = ("_scoring",)
    _kind = "predictor"

    def __init__(self, device: Optional[Device] = None,
                 weights: Union[None, PathLike, Weights] = None, *,
                 config: Union[None, str, "dict[str, Any]"] = None,
                 adapters: Union[None, PathLike, Weights] = None, alpha: float = 0.0,
                 aggregate: int = 0,
                 convention: Union[None, int, _native.ConventionName] = None) -> None:
        device = default_device() if device is None else device
        desc = _native.splat_predictor_desc(struct_size=sizeof(_native.splat_predictor_desc))
        if isinstance(weights, Weights):
            desc.weights = weights.handle
        else:
            desc.weights_path = path_of(weights, "weights")
        if isinstance(adapters, Weights):
            desc.adapters = adapters.handle
        else:
            desc.adapters_path = path_of(adapters, "adapters")
        desc.config, desc.adapters_alpha = json_of(config, "config"), alpha
        desc.aggregate = whole(aggregate, "aggregate")
        desc.convention = choice(_native.Convention, convention, "convention")
        self._own(made("predictor", direct, lib.splat_predictor_create, device.handle, byref(desc)),
                  device)
        self._scoring = threading.RLock()  # the library wants one of its evaluators at a time
        _warn(self.report["warnings"])

    @property
    def info(self) -> PredictorInfo:
        """What it takes and gives, for what its weights were trained."""
        info = _native.splat_predictor_info(struct_size=sizeof(_native.splat_predictor_info))
        with self._lent() as kept:
            check(lib.splat_predictor_get_info(kept.handle, byref(info)))
            return PredictorInfo.of(info)

    @property
    def report(self) -> Dict[str, Any]:
        """Weights, warnings, metadata and the whole configuration."""
        found: Dict[str, Any] = json_from(lib.splat_predictor_report, self.handle)
        return found

    def predict(self, pictures: Union[Picture, Source, Sequence[Union[Picture, Source]]]
                ) -> Prediction:
        """Predict a scene from as many pictures as the network has views.

        pictures  one or a list: a path, the bytes of a file, pixels [height,width,channels], or a
                  `Picture` with a mask, maps, or a pose
        Raises NotFound, FormatError, InvalidArgument (a map that the network needs and the picture
        lacks), InvalidState (the output is not finite), Cancelled.
        """
        raw, kept = picture_array(pictures)
        return self._predict(lib.splat_predictor_predict, len(raw), kept, raw, len(raw))

    def predict_object(self, dataset: Dataset, index: int,
                       views: Optional[Sequence[int]] = None) -> Prediction:
        """Predict an object of a data set that was opened with the predictor's resolution.

        views  numbers of views; the network sees the first of them. None: all
        """
        numbers = view_numbers(dataset, index, views)
        return self._predict(lib.splat_predictor_predict_object, len(numbers), None,
                             dataset.handle, whole(index, "index"), numbers, len(numbers))

    def _predict(self, function: Callable[..., int], views: int, kept: Any,
                 *arguments: Any) -> Prediction:
        info = self.info
        cameras = (_native.splat_camera * max(views, info.views))()
        pictures = (_native.splat_picture_info * max(views, 1))()
        inputs = np.empty((info.views, info.channels, info.resolution, info.resolution), np.float32)
        raw = _native.splat_prediction(struct_size=sizeof(_native.splat_prediction))
        raw.cameras, raw.camera_capacity = cameras, len(cameras)
        raw.pictures, raw.picture_capacity = pictures, len(pictures)
        raw.inputs, raw.input_capacity = address(inputs), inputs.size
        raw.kept = (inputs, kept)  # kept as long as the call runs

        def call(_: object, *given: Any) -> int:  # the facts come behind the new scene
            return self._run(function, self.handle, *given, byref(raw))

        scene = Scene._of(made("scene", call, function, *arguments))
        report: Dict[str, Any] = json_from(lib.splat_prediction_report, byref(raw))
        _warn([text for each in report["pictures"] for text in each["warnings"]])
        return Prediction(scene, [Camera._of(each) for each in cameras[:raw.camera_count]],
                          [PictureInfo.of(each) for each in pictures[:raw.picture_count]], inputs,
                          report)


def _warn(sentences: Sequence[str]) -> None:
    """Give sentences to `warnings`, as of the line that called this package."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals.get("__package__") == __package__:
        level, frame = level + 1, frame.f_back
    del frame  # it would keep itself
    for sentence in sentences:
        warnings.warn(sentence, UserWarning, level)
