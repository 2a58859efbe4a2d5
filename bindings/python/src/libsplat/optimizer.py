"""Adam over parameters of models, modules and tensors."""
import threading
from ctypes import byref, sizeof
from dataclasses import dataclass
from typing import Any, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._errors import InvalidArgument, check, direct
from ._handle import Handle, made
from ._library import lib
from ._records import OptimizerInfo
from ._text import choice, encoded
from .device import Device, whole
from .model import Model
from .module import Module
from .tensor import Tensor
from .weights import Weights

# A model, a module, (prefix, one of them), or (name, parameter, gradient).
Item = Union[Model, Module, Tuple[str, Union[Model, Module]], Tuple[str, Tensor, Tensor]]


@dataclass(frozen=True)
class Group:
    """Parameters with numbers of their own, by a pattern of names with * and ?; 0: the optimizer's.

    rate_factor  of the optimizer's rate; 0: 1
    """

    pattern: str
    rate_factor: float = 0.0
    beta1: float = 0.0
    beta2: float = 0.0
    eps: float = 0.0


def _fill(raw: Any, item: Any) -> None:
    parts = item if isinstance(item, tuple) else (None, item)
    raw.name = encoded(parts[0], "a name")
    if len(parts) == 3 and isinstance(parts[1], Tensor) and isinstance(parts[2], Tensor):
        raw.parameter, raw.gradient = parts[1].handle, parts[2].handle
    elif len(parts) == 2 and isinstance(parts[1], Model):
        raw.model = parts[1].handle
    elif len(parts) == 2 and isinstance(parts[1], Module):
        raw.module = parts[1].handle
    else:
        raise InvalidArgument("an item must be a Model, a Module, (prefix, one of them), or (name, "
                              f"parameter tensor, gradient tensor), but is {item!r}")


class Optimizer(Handle):
    """Adam (Kingma & Ba 2015) with a schedule of the rate and averaged weights.

    items         what to update, see `Item`; the optimizer keeps it alive
    groups        of several that match a name, the first has the parameter
    rate          0: 5e-5; beta1 0: 0.9; beta2 0: 0.999; eps 0: 1e-15
    schedule      "constant", "cosine" (zero one step after total_steps) or "step" (a tenth from step_at)
    warmup_steps  in which the rate rises from zero
    ema_decay     of the averages; 0: none; ema_every, ema_after: steps between them, before them
    Raises InvalidArgument, InvalidState (made without gradients), ShapeMismatch.
    """

    __slots__ = ()
    _kind = "optimizer"

    def __init__(self, device: Device, items: Sequence[Item], *, groups: Sequence[Group] = (),
                 rate: float = 0.0, beta1: float = 0.0, beta2: float = 0.0, eps: float = 0.0,
                 schedule: Union[None, int, _native.ScheduleName] = None, warmup_steps: int = 0,
                 total_steps: int = 0, step_at: int = 0, ema_decay: float = 0.0,
                 ema_every: int = 0, ema_after: int = 0) -> None:
        desc = _native.splat_optimizer_desc(struct_size=sizeof(_native.splat_optimizer_desc))
        desc.items = (_native.splat_optimizer_item * len(items))()
        desc.item_count = len(items)
        for index, item in enumerate(items):
            _fill(desc.items[index], item)
        desc.groups = (_native.splat_optimizer_group * len(groups))(
            *(_native.splat_optimizer_group(encoded(group.pattern, "pattern"), group.rate_factor,
                                            group.beta1, group.beta2, group.eps)
              for group in groups))
        desc.group_count = len(groups)
        desc.rate, desc.beta1, desc.beta2, desc.eps = rate, beta1, beta2, eps
        desc.schedule = choice(_native.Schedule, schedule, "schedule")
        desc.ema_decay = ema_decay
        for name, value in (("warmup_steps", warmup_steps), ("total_steps", total_steps),
                            ("step_at", step_at), ("ema_every", ema_every),
                            ("ema_after", ema_after)):
            setattr(desc, name, whole(value, name, 64))
        self._own(made("optimizer", direct, lib.splat_optimizer_create, device.handle, byref(desc)),
                  device)
        self._lock = threading.RLock()

    def step(self) -> OptimizerInfo:
        """Update the parameters from their gradients, which stay; not if one is not finite."""
        info = _native.splat_optimizer_info(struct_size=sizeof(_native.splat_optimizer_info))
        self._run(lib.splat_optimizer_step, self.handle, byref(info))
        return OptimizerInfo.of(info)

    def zero_gradients(self) -> None:
        """Set all gradients to zero."""
        self._run(lib.splat_optimizer_zero_gradients, self.handle)

    def gather_rows(self, pattern: str, rows: ArrayLike) -> None:
        """Reorder, drop and add rows of tensors, with their moments and averages.

        pattern  of names of tensors with equally many rows; * is any text, ? one character
        rows     integers: row i becomes row rows[i]; -1: a new row, as it lies in the tensor
        """
        array = np.asarray(rows)
        if array.ndim != 1 or array.dtype.kind not in "iu":
            raise InvalidArgument(f"rows has the type {array.dtype} and {array.ndim} dimensions, "
                                  "expected integers in one")
        numbers = np.ascontiguousarray(array, np.int64)
        self._run(lib.splat_optimizer_gather_rows, self.handle, encoded(pattern, "pattern"),
                  numbers.ctypes.data, numbers.size)

    def set_rate(self, rate: float) -> None:
        """Replace the rate, which the schedule and the groups scale."""
        self._call(lib.splat_optimizer_set_rate, self.handle, rate)

    @property
    def info(self) -> OptimizerInfo:
        """Steps done, the rate, and what the last step found."""
        info = _native.splat_optimizer_info(struct_size=sizeof(_native.splat_optimizer_info))
        check(lib.splat_optimizer_get_info(self.handle, byref(info)))
        return OptimizerInfo.of(info)

    def store(self) -> Weights:
        """The averaged parameters by name; without averages the parameters."""
        return Weights._of(made("weights", self._run, lib.splat_optimizer_store, self.handle))

    def state(self) -> Weights:
        """Moments, averages, counters and rate, for `load`. Parameters are not in it."""
        return Weights._of(made("weights", self._run, lib.splat_optimizer_save, self.handle))

    def load(self, state: Weights) -> None:
        """Go on from such a state, bit-exactly. On an error nothing is changed."""
        self._run(lib.splat_optimizer_load, self.handle, state.handle)
