"""Which of two methods is better, or whether the difference is chance."""
from ctypes import byref, sizeof
from typing import Any, Dict, List, Mapping, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arrays import address
from ._errors import check, direct
from ._handle import Handle, made
from ._library import lib
from ._records import ComparisonInfo, MetricComparison
from ._text import PathLike, encoded, flags_of, json_from, path_of
from .device import whole

# A file or folder of scores, or (psnr, ssim, lpips) of each object by its name; NaN: none.
ScoreSet = Union[PathLike, Mapping[str, Sequence[float]]]


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
