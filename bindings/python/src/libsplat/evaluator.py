"""How good a network is, by the published protocol on a data set; which of two methods is better."""
import threading
from ctypes import addressof, byref, c_double, c_uint32, c_void_p, sizeof
from dataclasses import dataclass
from typing import Any, Callable, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arrays import ArrayLike, ByValue, Floats, address, floats, planes_struct
from ._errors import check, direct
from ._handle import Handle, made
from ._library import lib
from ._records import ComparisonInfo, EvaluationSummary, EvaluatorInfo, MetricComparison, ObjectScores
from ._text import PathLike, encoded, flags_of, json_from, path_of
from .camera import Camera
from .dataset import Dataset
from .device import Device, default_device, whole
from .predictor import Predictor
from .weights import Weights

# A file or folder of scores, or (psnr, ssim, lpips) of each object by its name; NaN: none.
ScoreSet = Union[PathLike, Mapping[str, Sequence[float]]]


class Lpips(Handle):
    """Learned perceptual image patch similarity 0.1 with VGG16, for images of one size.

    weights  of torchvision's vgg16 and of the lpips package, one file or two
    side     pixels, both ways; >= 16
    """

    __slots__ = ("_side",)
    _kind = "lpips"

    def __init__(self, weights: Sequence[Weights], side: int,
                 device: Optional[Device] = None) -> None:
        device = default_device() if device is None else device
        desc = _native.splat_lpips_desc(struct_size=sizeof(_native.splat_lpips_desc))
        handles = (c_void_p * len(weights))(*(each.handle for each in weights))
        desc.weights, desc.weight_count = handles, len(weights)
        desc.side = self._side = whole(side, "side")
        self._own(made("lpips", direct, lib.splat_lpips_create, device.handle, byref(desc)), device)
        self._lock = threading.RLock()

    def compare(self, a: ArrayLike, b: ArrayLike) -> float:
        """The distance of two RGB images, float32 [3,side,side] nominally 0 to 1; 0 if equal."""
        shape = (3, self._side, self._side)
        first, second = floats(a, shape, "a"), floats(b, shape, "b")
        value = c_double()
        self._run(lib.splat_lpips_compare, self.handle, byref(planes_struct(first)),
                  byref(planes_struct(second)), byref(value))
        return value.value


@dataclass(frozen=True, eq=False)
class EvaluatedViews(ByValue):
    """The views of an object that are scored, conditioning ones first.

    inputs, novel  how many of each
    numbers        of the views in the data set
    cameras        in the frame of the first view
    images, drawn  float32 [n,3,R,R]: targets, and what was drawn (None unless asked for)
    """

    inputs: int
    novel: int
    numbers: List[int]
    cameras: List[Camera]
    images: Floats
    drawn: Optional[Floats]


class Evaluator(Handle):
    """Scores a predictor, or images of the caller, on the objects of a data set.

    predictor     None: images of the caller, scored by `score_images`, with a name as `method`
    dataset       opened with the predictor's resolution, background and maps; None: data_path
    data_path     a folder, opened as the predictor's configuration says; None: its data.root
    split         of that folder
    lpips         None: LPIPS is NaN
    conditioning  numbers of the conditioning views; None: by the protocol
    inputs        conditioning views without a predictor; 0: 1
    novel_views   of each object, evenly spread; 0: all
    objects       only this many; 0: all
    Threads take turns on the evaluators of one predictor.
    Raises InvalidArgument, ShapeMismatch, and as `Dataset`.
    """

    __slots__ = ()
    _kind = "evaluator"

    def __init__(self, predictor: Optional[Predictor] = None, dataset: Optional[Dataset] = None, *,
                 data_path: Optional[PathLike] = None, split: Optional[str] = None,
                 method: Optional[str] = None, lpips: Optional[Lpips] = None,
                 conditioning: Optional[Sequence[int]] = None, inputs: int = 0,
                 novel_views: int = 0, objects: int = 0) -> None:
        desc = _native.splat_evaluator_desc(struct_size=sizeof(_native.splat_evaluator_desc))
        desc.predictor = None if predictor is None else predictor.handle
        desc.dataset = None if dataset is None else dataset.handle
        desc.lpips = None if lpips is None else lpips.handle
        desc.data_path, desc.split = path_of(data_path, "data_path"), encoded(split, "split")
        desc.method = encoded(method, "method")
        numbers = [whole(each, "conditioning") for each in conditioning or ()]
        chosen = (c_uint32 * len(numbers))(*numbers)
        if numbers:
            desc.conditioning = addressof(chosen)
            desc.conditioning_count = len(numbers)
        desc.inputs, desc.novel_views = whole(inputs, "inputs"), whole(novel_views, "novel_views")
        desc.objects = whole(objects, "objects")
        self._own(made("evaluator", direct, lib.splat_evaluator_create, byref(desc)),
                  None if predictor is None else predictor._device)
        self._lock = threading.RLock() if predictor is None else predictor._scoring

    @property
    def info(self) -> EvaluatorInfo:
        """Objects to score, scored so far, and the resolution."""
        info = _native.splat_evaluator_info(struct_size=sizeof(_native.splat_evaluator_info))
        check(lib.splat_evaluator_get_info(self.handle, byref(info)))
        return EvaluatorInfo.of(info)

    def __len__(self) -> int:
        return self.info.objects

    def __iter__(self) -> Iterator[ObjectScores]:
        return (self.score(index) for index in range(len(self)))

    def score(self, index: int) -> ObjectScores:
        """Predict an object, draw its views and score them."""
        return self._scores(lib.splat_evaluator_score, whole(index, "index"))

    def score_images(self, index: int, images: ArrayLike) -> ObjectScores:
        """Score float32 images [n,3,R,R] of the views that `read` gives, in their order."""
        array = floats(images, (None, 3, None, None), "images")
        return self._scores(lib.splat_evaluator_score_images, whole(index, "index"),
                            address(array), array.size)

    def _scores(self, function: Callable[..., int], *arguments: Any) -> ObjectScores:
        raw = _native.splat_object_scores(struct_size=sizeof(_native.splat_object_scores))
        with self._lent() as kept:
            self._run(function, kept.handle, *arguments, byref(raw))
            return ObjectScores.of(raw)

    def read(self, index: int, drawn: bool = False) -> EvaluatedViews:
        """The views of an object.

        drawn  also what the latest `score` drew; InvalidState if that was another object
        """
        raw = _native.splat_evaluated_views(struct_size=sizeof(_native.splat_evaluated_views))
        number = whole(index, "index")
        self._run(lib.splat_evaluator_read, self.handle, number, byref(raw))
        n, side = raw.inputs + raw.novel, self.info.resolution
        numbers, cameras = np.empty(n, np.uint32), (_native.splat_camera * n)()
        images = np.empty((n, 3, side, side), np.float32)
        shown = np.empty_like(images) if drawn else None
        raw.numbers, raw.number_count = address(numbers), n
        raw.cameras, raw.camera_count = cameras, n
        raw.images, raw.image_count = address(images), images.size
        raw.kept = (numbers, images, shown)  # kept as long as the call runs
        if shown is not None:
            raw.drawn, raw.drawn_count = address(shown), shown.size
        self._run(lib.splat_evaluator_read, self.handle, number, byref(raw))
        return EvaluatedViews(raw.inputs, raw.novel, numbers.tolist(),
                              [Camera._of(each) for each in cameras], images, shown)

    def summary(self) -> EvaluationSummary:
        """Means and sums over the objects scored so far."""
        raw = _native.splat_evaluation_summary(struct_size=sizeof(_native.splat_evaluation_summary))
        check(lib.splat_evaluator_summary(self.handle, byref(raw)))
        return EvaluationSummary.of(raw)

    @property
    def report(self) -> Dict[str, Any]:
        """The content of results.json."""
        found: Dict[str, Any] = json_from(lib.splat_evaluator_report, self.handle)
        return found

    def save(self, folder: PathLike) -> None:
        """Write results.json, per_object.csv, per_image.csv, scores.txt, objects.json to a folder, made if missing."""
        self._call(lib.splat_evaluator_save, self.handle, path_of(folder, "folder"))

    def load(self, folder: PathLike) -> None:
        """Take over the scores in a folder of `save`, by the objects' names.

        Raises InvalidArgument (other weights, data or objects), NotFound, FormatError.
        """
        self._call(lib.splat_evaluator_load, self.handle, path_of(folder, "folder"))


def _fill(raw: Any, given: ScoreSet, what: str) -> None:
    if not isinstance(given, Mapping):
        raw.path = path_of(given, what)
        return
    scores = [_native.splat_score(encoded(name, f"a name of {what}"), *values)
              for name, values in given.items()]
    raw.scores = (_native.splat_score * len(scores))(*scores)
    raw.score_count = len(scores)


class Comparison(Handle):
    """Compares B with A in every metric that both have; the same numbers for the same seed.

    a, b        per_object.csv, scores.txt, or the folder of an evaluation; or a dict of
                (psnr, ssim, lpips) by the names of objects
    unpaired    ignore which object a score belongs to
    resamples   random permutations; 0: 300000
    bootstraps  samples of the interval; 0: 10000
    Raises NotFound (no file; no shared object), FormatError, InvalidArgument.
    """

    __slots__ = ()
    _kind = "comparison"

    def __init__(self, a: ScoreSet, b: ScoreSet, *, unpaired: bool = False, seed: int = 0,
                 resamples: int = 0, bootstraps: int = 0) -> None:
        desc = _native.splat_compare_desc(struct_size=sizeof(_native.splat_compare_desc))
        desc.flags = flags_of((unpaired, _native.CompareFlags.UNPAIRED))
        _fill(desc.a, a, "a")
        _fill(desc.b, b, "b")
        desc.seed, desc.resamples = whole(seed, "seed", 64), whole(resamples, "resamples")
        desc.bootstraps = whole(bootstraps, "bootstraps")
        self._own(made("comparison", direct, lib.splat_compare_scores, byref(desc)))

    @property
    def info(self) -> ComparisonInfo:
        """Counts of metrics and objects, and whether the two can be compared."""
        info = _native.splat_comparison_info(struct_size=sizeof(_native.splat_comparison_info))
        check(lib.splat_comparison_get_info(self.handle, byref(info)))
        return ComparisonInfo.of(info)

    def metrics(self) -> List[MetricComparison]:
        """The comparison in each metric."""
        found = []
        for index in range(self.info.metrics):
            raw = _native.splat_metric_comparison(
                struct_size=sizeof(_native.splat_metric_comparison))
            check(lib.splat_comparison_metric(self.handle, index, byref(raw)))
            found.append(MetricComparison.of(raw))
        return found

    def samples(self, index: int) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The scores of A and B that were compared in one metric, by its place in `metrics`."""
        raw = _native.splat_metric_comparison(struct_size=sizeof(_native.splat_metric_comparison))
        number = whole(index, "index")
        check(lib.splat_comparison_metric(self.handle, number, byref(raw)))
        a, b = np.empty(raw.n_a), np.empty(raw.n_b)
        check(lib.splat_comparison_samples(self.handle, number, address(a), a.size, address(b),
                                           b.size))
        return a, b

    @property
    def report(self) -> Dict[str, Any]:
        """All numbers and verdicts."""
        found: Dict[str, Any] = json_from(lib.splat_comparison_report, self.handle)
        return found
